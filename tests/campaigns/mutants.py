"""
Random mutants of scanfab, one at a time, and whether its tests catch them.

    python tests/campaigns/mutants.py REPO PYTHON NUMBER SEED [--only room,room] [--jobs N] ...

REPO is a scratch copy: its files are changed and restored. PYTHON has scanfab[test] installed from
it. The same seed gives the same mutants of the same code; shard I/K takes every K-th of them, so
that several copies can work at once. Results are lines of JSON. About 45 s a mutant on one core; a
mutant that runs into its time limit is not killed yet.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

ROOMS = ("base", "scan", "packing", "fabric", "io", "table", "pipeline", "viz", "cli")
REACHING = ("tests/cli/test_compute.py", "tests/identities", "tests/pipeline")
QUIET = {"__repr__", "__str__", "_repr_html_", "__rich__", "_repr_pretty_"}
SPOKEN = {"warn", "warning", "info", "debug", "log", "note", "error", "exception"}
ARITHMETIC = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
COMPARED = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.GtE), ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE), ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
}  # fmt: skip


def is_text(node):
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def name_of(call):
    f = call.func
    return f.attr if isinstance(f, ast.Attribute) else f.id if isinstance(f, ast.Name) else ""


class Sites(ast.NodeVisitor):
    """All mutants of a file: kind, node, text in its place."""

    def __init__(self):
        self.found = []  # (kind, node, text)
        self.known = [set()]  # names stored before, for each function

    def add(self, kind, node, text):
        self.found.append((kind, node, text))

    def expression(self, kind, node, new):
        self.add(kind, node, f"({ast.unparse(new)})")

    # what is left alone
    def visit_Raise(self, node): ...
    def visit_Import(self, node): ...
    def visit_ImportFrom(self, node): ...
    def visit_JoinedStr(self, node): ...
    def visit_Assert(self, node): ...

    def visit_FunctionDef(self, node):
        if node.name in QUIET:
            return
        a = node.args
        self.known.append({x.arg for x in a.posonlyargs + a.args + a.kwonlyargs})
        for default in [*a.defaults, *a.kw_defaults]:
            if default is not None:
                self.visit(default)
        for one in node.body:
            self.visit(one)
        self.known.pop()

    visit_AsyncFunctionDef = visit_FunctionDef

    def visit_ClassDef(self, node):
        self.known.append(set())
        for one in node.body:
            self.visit(one)
        self.known.pop()

    def visit_Lambda(self, node):
        self.visit(node.body)

    def visit_AnnAssign(self, node):
        if node.value is not None:
            self.visit(node.value)
            if isinstance(node.target, ast.Attribute | ast.Subscript):
                self.add("drop", node, "pass")
        if isinstance(node.target, ast.Name):
            self.known[-1].add(node.target.id)

    def visit_Assign(self, node):
        stored = [x for t in node.targets for x in ast.walk(t) if isinstance(x, ast.Name)]
        names = [x.id for x in stored if isinstance(x.ctx, ast.Store)]
        if len(self.known) == 1 and "TypeVar" in ast.unparse(node.value):
            return
        if len(self.known) > 1 and all(x in self.known[-1] for x in names):
            self.add("drop", node, "pass")
        self.visit(node.value)
        for target in node.targets:
            self.visit(target)
        self.known[-1].update(names)

    def visit_For(self, node):
        self.known[-1].update(x.id for x in ast.walk(node.target) if isinstance(x, ast.Name))
        self.generic_visit(node)

    def visit_AugAssign(self, node):
        self.add("drop", node, "pass")
        other = ARITHMETIC.get(type(node.op))
        if other and not is_text(node.value):
            new = copy.deepcopy(node)
            new.op = other()
            self.add("arithmetic", node, ast.unparse(new))
        self.generic_visit(node)

    def visit_Expr(self, node):
        if is_text(node.value):
            return
        if isinstance(node.value, ast.Call):
            self.add("drop", node, "pass")
        self.generic_visit(node)

    def visit_Return(self, node):
        v = node.value
        if v is None:
            return
        if isinstance(v, ast.Compare | ast.BoolOp) or (
            isinstance(v, ast.UnaryOp) and isinstance(v.op, ast.Not)
        ):
            self.add("return", node, f"return not ({ast.unparse(v)})")
        elif isinstance(v, ast.Constant) and isinstance(v.value, bool):
            self.add("return", node, f"return {not v.value}")
        elif isinstance(v, ast.Tuple) and len(v.elts) > 1:
            new = copy.deepcopy(v)
            new.elts[0], new.elts[1] = new.elts[1], new.elts[0]
            self.add("return", node, f"return {ast.unparse(new)}")
        elif isinstance(v, ast.IfExp):
            new = copy.deepcopy(v)
            new.body, new.orelse = new.orelse, new.body
            self.add("return", node, f"return {ast.unparse(new)}")
        elif not is_text(v) and not (isinstance(v, ast.Constant) and v.value is None):
            self.add("return", node, "return None")
        self.generic_visit(node)

    def condition(self, test):
        if "TYPE_CHECKING" not in ast.unparse(test):
            self.add("negate", test, f"(not ({ast.unparse(test)}))")

    def visit_If(self, node):
        self.condition(node.test)
        self.generic_visit(node)

    visit_While = visit_IfExp = visit_If

    def visit_comprehension(self, node):
        for test in node.ifs:
            self.condition(test)
        self.generic_visit(node)

    def visit_BinOp(self, node):
        other = ARITHMETIC.get(type(node.op))
        sides = (node.left, node.right)
        if other and not any(
            is_text(x) or isinstance(x, ast.List | ast.Tuple | ast.ListComp) for x in sides
        ):
            types = isinstance(node.op, ast.BitOr) and re.search(
                r"\bNone\b|\b[A-Z][a-z]|\b(str|int|float|bool)\b", ast.unparse(node)
            )
            if not types:
                new = copy.deepcopy(node)
                new.op = other()
                self.expression("arithmetic", node, new)
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        new = copy.deepcopy(node)
        new.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        self.expression("negate", node, new)
        self.generic_visit(node)

    def visit_Compare(self, node):
        for i, op in enumerate(node.ops):
            for other in COMPARED.get(type(op), ()):
                new = copy.deepcopy(node)
                new.ops[i] = other()
                self.expression("comparison", node, new)
        self.generic_visit(node)

    def visit_Constant(self, node):
        v = node.value
        if isinstance(v, bool):
            self.add("constant", node, str(not v))
        elif isinstance(v, int):
            self.add("constant", node, str(v + 1))
        elif isinstance(v, float):
            self.add("constant", node, repr(v * 1.1) if v else "1.0")

    def visit_Call(self, node):
        if name_of(node) in SPOKEN | {"TypeVar", "NewType", "cast"}:
            return
        args = node.args
        if not any(isinstance(x, ast.Starred) for x in args) and name_of(node) != "isinstance":
            for i in range(len(args) - 1):
                if ast.unparse(args[i]) != ast.unparse(args[i + 1]):
                    new = copy.deepcopy(node)
                    new.args[i], new.args[i + 1] = new.args[i + 1], new.args[i]
                    self.add("arguments", node, ast.unparse(new))
        self.generic_visit(node)

    def visit_Subscript(self, node):
        # a type in its brackets, as in tuple[int, int]
        if isinstance(node.value, ast.Name) and node.value.id in (
            "tuple", "list", "dict", "type", "Literal", "Callable", "Iterator", "Sequence",
        ):  # fmt: skip
            return
        self.generic_visit(node)


def code_lines(text):
    return sum(bool(x.strip()) and not x.strip().startswith("#") for x in text.splitlines())


class Mutants:
    def __init__(self, repo, only):
        self.files = {}
        for room in only:
            for path in sorted((repo / "scanfab" / room).rglob("*.py")):
                text = path.read_text()
                sites = Sites()
                sites.visit(ast.parse(text))
                kinds = {}
                for kind, node, new in sites.found:
                    kinds.setdefault(kind, []).append((node, new))
                if kinds:
                    name = str(path.relative_to(repo))
                    self.files[name] = (code_lines(text), text, kinds)

    def draw(self, rng):
        names = sorted(self.files)
        name = rng.choices(names, [self.files[x][0] for x in names])[0]
        _, text, kinds = self.files[name]
        kind = rng.choice(sorted(kinds))
        node, new = rng.choice(kinds[kind])
        lines = text.encode().splitlines(keepends=True)
        start = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
        end = sum(map(len, lines[: node.end_lineno - 1])) + node.end_col_offset
        raw = text.encode()
        old = raw[start:end].decode()
        mutated = (raw[:start] + new.encode() + raw[end:]).decode()
        ast.parse(mutated)
        short = " ".join(old.split())
        return {
            "file": name, "line": node.lineno, "kind": kind,
            "change": f"{short[:160]}  ->  {' '.join(new.split())[:160]}",
        }, mutated  # fmt: skip


def stages(repo, name):
    """Tests of the room, those of the module first; then what reaches it."""
    parts = Path(name).with_suffix("").parts[1:]
    room, module = parts[0], ".".join(("scanfab", *parts))
    tests = sorted((repo / "tests" / room).rglob("test_*.py"))
    near = [x for x in tests if x.stem == f"test_{parts[-1]}"]
    last = re.compile(rf"\b{re.escape(module)}\b")
    near += [x for x in tests if x not in near and last.search(x.read_text())]
    if len(parts) > 2:  # those of pipeline/maps are test_map.py and its like
        folder = f"test_{parts[-2].rstrip('s')}"
        near += [x for x in tests if x not in near and x.stem.startswith(folder)]
    # those that name most of what the module gives
    words = re.findall(r"^(?:def|class) ([a-z]\w*)", (repo / name).read_text(), re.MULTILINE | re.I)
    named = re.compile(rf"\b({'|'.join(words)})\b") if words else re.compile("(?!)")
    counts = {x: len(set(named.findall(x.read_text()))) for x in tests if x not in near}
    near += sorted((x for x in counts if counts[x]), key=lambda x: -counts[x])[:3]
    if name.endswith("pipeline/cluster.py"):
        # the rest of the room by itself, as its tests begin no cluster
        near = sorted((repo / "tests/pipeline/cluster").glob("test_*.py"))
    else:
        near = [x for x in near if x.parent.name != "cluster"]
    near = [str(x.relative_to(repo)) for x in near]
    # pytest would take a folder and its own file as the folder, in its usual order
    first = [f"tests/{room}", *(f"--ignore={x}" for x in near)]
    rest = [x for x in REACHING if x != f"tests/{room}"]
    # kernels compile for minutes, and some tests run them as plain Python
    uncompiled = [[f"tests/{room}", "-k", "uncompiled"]] if is_kernel(name) else []
    return [*uncompiled, *([near] if near else []), first, rest]


def is_kernel(name):
    return "/kernels/" in name or name.endswith("/kernels.py")


def run_tests(repo, python, paths, limit, jobs):
    words = [python, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider"]
    # schedulers of a cluster start for each of its tests: minutes
    cluster = "tests/pipeline/cluster"
    if "tests/pipeline" in paths and not any(x.startswith(cluster) for x in paths):
        words.append(f"--ignore={cluster}")
    words += ["-n", str(jobs)] if jobs > 1 else ["-p", "no:xdist", "-v"]
    env = {**os.environ, "PYTHONPATH": str(repo), "PYTHONDONTWRITEBYTECODE": "1"}
    began = time.time()
    done = subprocess.Popen(
        [*words, "--tb=line", *paths], cwd=repo, env=env, text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    try:
        text, _ = done.communicate(timeout=max(limit, 1))
        code = done.returncode
    except subprocess.TimeoutExpired:
        os.killpg(done.pid, signal.SIGKILL)
        text, _ = done.communicate()
        code = None
    except BaseException:
        os.killpg(done.pid, signal.SIGKILL)
        raise
    return code, text, time.time() - began


def judge(repo, python, name, limit, jobs):
    """How the tests take it: killed, timeout or survived; by which test; seconds of each stage."""
    left, spent = limit, []
    for number, paths in enumerate(stages(repo, name), 1):
        code, text, took = run_tests(repo, python, paths, left, jobs)
        spent.append(round(took, 1))
        left -= took
        lines = text.strip().splitlines()
        if code is None:
            passed = sum("PASSED" in x for x in lines)
            by = f"{passed} passed; last: {lines[-1][:150] if lines else ''}"
            return "timeout", number, by, spent
        if code and not (code == 5 and "-k" in paths):  # 5: there are none
            failed = [x for x in lines if x.startswith(("FAILED", "ERROR"))]
            return "killed", number, (failed or lines[-1:] or [f"rc {code}"])[0][:200], spent
    return "survived", len(spent), "", spent


def main():
    a = argparse.ArgumentParser()
    a.add_argument("repo", type=Path)
    a.add_argument("python")
    a.add_argument("number", type=int)
    a.add_argument("seed", type=int)
    a.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    a.add_argument("--shard", default="0/1")
    a.add_argument("--jobs", type=int, default=2, help="pytest -n; 1 runs without xdist")
    a.add_argument("--limit", type=float, default=240)
    a.add_argument("--kernel-limit", type=float, default=480)
    a.add_argument("--until", help="HH:MM after which no mutant is begun")
    a.add_argument("--only", default=",".join(ROOMS))
    a.add_argument("--skip-done", type=Path, action="append", default=[], help="results to skip")
    a.add_argument("--list", action="store_true", help="only tell them")
    a.add_argument("--what", help="run only mutants whose 'file:line: change' has this in it")
    given = a.parse_args()
    repo = given.repo.resolve()
    shard, of = map(int, given.shard.split("/"))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # restores the file
    done = {
        json.loads(x)["number"]
        for file in given.skip_done if file.exists() for x in file.read_text().splitlines()
    }  # fmt: skip
    rng, mutants = random.Random(given.seed), Mutants(repo, given.only.split(","))
    drawn, seen = [], set()
    while len(drawn) < given.number:
        what, text = mutants.draw(rng)
        key = (what["file"], text)
        if key not in seen:
            seen.add(key)
            drawn.append((what, text))
    for number, (what, text) in enumerate(drawn):
        words = f"{what['file']}:{what['line']}: {what['change']}"
        if given.list:
            print(number, what["kind"], words)
            continue
        if number % of != shard or number in done or (given.what and given.what not in words):
            continue
        if given.until and datetime.now().strftime("%H:%M") >= given.until:
            break
        if what["kind"] == "arguments" and re.match(r"(max|min)\(", what["change"]):
            print(number, "equivalent", words, flush=True)  # NaN aside
            continue
        path = repo / what["file"]
        before = path.read_text()
        limit = given.kernel_limit if is_kernel(what["file"]) else given.limit
        try:
            path.write_text(text)
            verdict, stage, by, spent = judge(repo, given.python, what["file"], limit, given.jobs)
        finally:
            path.write_text(before)
        result = {
            "number": number,
            **what,
            "verdict": verdict,
            "stage": stage,
            "by": by,
            "s": spent,
        }
        with given.out.open("a") as file:
            file.write(json.dumps(result) + "\n")
        print(number, verdict, spent, words, "|", by, flush=True)


if __name__ == "__main__":
    sys.exit(main())
