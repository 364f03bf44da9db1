"""
Random mutants of scanfab, one at a time, and whether its tests catch them.

    python tests/campaigns/mutants.py REPO PYTHON NUMBER SEED [--only room,room] [--jobs N] ...

REPO is a scratch copy: its files are changed and restored. PYTHON has scanfab[test] installed from
it. The same seed gives the same mutants of the same code; shard I/K takes every K-th of them, so
that several copies can work at once. Results are lines of JSON in --out; mutants that are there are
not tried again. About 45 s a mutant on one core; a mutant that runs into its time limit is not
killed yet.
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
GENERIC = {"tuple", "list", "dict", "type", "Literal", "Callable", "Iterator", "Sequence"}
TYPES = re.compile(r"\bNone\b|\b[A-Z][a-z]|\b(str|int|float|bool)\b")


def is_text(node):
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def name_of(call):
    f = call.func
    return f.attr if isinstance(f, ast.Attribute) else f.id if isinstance(f, ast.Name) else ""


def swapped(values, i):
    """A list with two neighbours in each other's place."""
    return [*values[:i], values[i + 1], values[i], *values[i + 2 :]]


def changed(node, **fields):
    """A copy of a node with other fields."""
    new = copy.copy(node)
    for name, value in fields.items():
        setattr(new, name, value)
    return new


class Sites(ast.NodeVisitor):
    """All mutants of a file: kind, node, text in its place."""

    def __init__(self):
        self.found = []  # (kind, node, text)
        self.known = [set()]  # names stored before, for each function

    def add(self, kind, node, new):
        """A text or a node in the place of another node; an expression in brackets."""
        text = new if isinstance(new, str) else ast.unparse(new)
        inner = isinstance(new, ast.BinOp | ast.BoolOp | ast.Compare)
        self.found.append((kind, node, f"({text})" if inner else text))

    # what is left alone
    def visit_Raise(self, node): ...

    visit_Import = visit_ImportFrom = visit_JoinedStr = visit_Assert = visit_Raise

    def visit_FunctionDef(self, node):
        if node.name in QUIET:
            return
        a = node.args
        self.known.append({x.arg for x in a.posonlyargs + a.args + a.kwonlyargs})
        for one in [*a.defaults, *a.kw_defaults, *node.body]:
            if one is not None:
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
            self.add("arithmetic", node, changed(node, op=other()))
        self.generic_visit(node)

    def visit_Expr(self, node):
        if is_text(node.value):
            return
        if isinstance(node.value, ast.Call):
            self.add("drop", node, "pass")
        self.generic_visit(node)

    def visit_Return(self, node):
        if node.value is None:
            return
        text = other_return(node.value)
        if text is not None:
            self.add("return", node, f"return {text}")
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
            types = isinstance(node.op, ast.BitOr) and TYPES.search(ast.unparse(node))
            if not types:
                self.add("arithmetic", node, changed(node, op=other()))
        self.generic_visit(node)

    def visit_BoolOp(self, node):
        other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        self.add("negate", node, changed(node, op=other))
        self.generic_visit(node)

    def visit_Compare(self, node):
        for i, op in enumerate(node.ops):
            for other in COMPARED.get(type(op), ()):
                ops = [*node.ops[:i], other(), *node.ops[i + 1 :]]
                self.add("comparison", node, changed(node, ops=ops))
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
                    self.add("arguments", node, changed(node, args=swapped(args, i)))
        self.generic_visit(node)

    def visit_Subscript(self, node):
        # a type in its brackets, as in tuple[int, int]
        if not (isinstance(node.value, ast.Name) and node.value.id in GENERIC):
            self.generic_visit(node)


def other_return(value):
    """What a function returns instead; None if nothing else makes sense."""
    if isinstance(value, ast.Compare | ast.BoolOp) or (
        isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.Not)
    ):
        return f"not ({ast.unparse(value)})"
    if isinstance(value, ast.Constant) and isinstance(value.value, bool):
        return str(not value.value)
    if isinstance(value, ast.Tuple) and len(value.elts) > 1:
        return ast.unparse(changed(value, elts=swapped(value.elts, 0)))
    if isinstance(value, ast.IfExp):
        return ast.unparse(changed(value, body=value.orelse, orelse=value.body))
    is_none = isinstance(value, ast.Constant) and value.value is None
    return None if is_text(value) or is_none else "None"


def code_lines(text):
    return sum(bool(x.strip()) and not x.strip().startswith("#") for x in text.splitlines())


def sites_of(repo, rooms):
    """Of each file: its lines of code, its text, and its mutants by kind."""
    files = {}
    for path in (x for room in rooms for x in (repo / "scanfab" / room).rglob("*.py")):
        text, sites, kinds = path.read_text(), Sites(), {}
        sites.visit(ast.parse(text))
        for kind, node, new in sites.found:
            kinds.setdefault(kind, []).append((node, new))
        if kinds:
            files[str(path.relative_to(repo))] = (code_lines(text), text, kinds)
    return files


def draw(files, rng):
    """A mutant, and the text of its file."""
    names = sorted(files)
    name = rng.choices(names, [files[x][0] for x in names])[0]
    _, text, kinds = files[name]
    kind = rng.choice(sorted(kinds))
    node, new = rng.choice(kinds[kind])
    lines = text.encode().splitlines(keepends=True)
    start = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
    end = sum(map(len, lines[: node.end_lineno - 1])) + node.end_col_offset
    raw = text.encode()
    mutated = (raw[:start] + new.encode() + raw[end:]).decode()
    ast.parse(mutated)
    change = [" ".join(x.split())[:160] for x in (raw[start:end].decode(), new)]
    return {
        "file": name, "line": node.lineno, "kind": kind, "change": "  ->  ".join(change)
    }, mutated  # fmt: skip


def drawn(files, number, seed):
    """So many different mutants; the same seed gives the same ones of the same code."""
    rng, found = random.Random(seed), {}
    while len(found) < number:
        what, text = draw(files, rng)
        found.setdefault((what["file"], text), (what, text))
    return [*found.values()]


def stages(repo, name):
    """Tests near the module, then those of the room, then what reaches it."""
    parts = Path(name).with_suffix("").parts[1:]
    room, module = parts[0], ".".join(("scanfab", *parts))
    # tests that say the module's name, or name the most of what it gives
    texts = {x: x.read_text() for x in sorted((repo / "tests" / room).rglob("test_*.py"))}
    near = [x for x in texts if x.stem == f"test_{parts[-1]}"]
    near += [x for x in texts if x not in near and re.search(rf"\b{module}\b", texts[x])]
    words = re.findall(r"^(?:def|class) ([a-z]\w*)", (repo / name).read_text(), re.MULTILINE | re.I)
    named = re.compile(rf"\b({'|'.join(words)})\b") if words else re.compile("(?!)")
    counts = {x: len(set(named.findall(texts[x]))) for x in texts if x not in near}
    near += sorted((x for x in counts if counts[x]), key=lambda x: -counts[x])[:3]
    # schedulers of a cluster start for each of its tests: minutes
    of_cluster = name.endswith("pipeline/cluster.py")
    near = [x for x in near if (x.parent.name == "cluster") == of_cluster]
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
    if "tests/pipeline" in paths:
        words.append("--ignore=tests/pipeline/cluster")
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


def tried(given, repo, what, text):
    """A mutant in the copy, and what its tests say."""
    path = repo / what["file"]
    before = path.read_text()
    # kernels compile for minutes
    limit = given.limit * (2 if is_kernel(what["file"]) else 1)
    try:
        path.write_text(text)
        verdict, stage, by, spent = judge(repo, given.python, what["file"], limit, given.jobs)
    finally:
        path.write_text(before)
    return {**what, "verdict": verdict, "stage": stage, "by": by, "s": spent}


def main():
    a = argparse.ArgumentParser()
    a.add_argument("repo", type=Path)
    a.add_argument("python")
    a.add_argument("number", type=int)
    a.add_argument("seed", type=int)
    a.add_argument(
        "--out", type=Path, default=Path("mutants.jsonl"), help="has those not to repeat"
    )
    a.add_argument("--shard", default="0/1")
    a.add_argument("--jobs", type=int, default=2, help="pytest -n; 1 runs without xdist")
    a.add_argument("--limit", type=float, default=240, help="seconds of a mutant; of kernels twice")
    a.add_argument("--until", help="HH:MM after which no mutant is begun")
    a.add_argument("--only", default=",".join(ROOMS))
    a.add_argument("--list", action="store_true", help="only tell them")
    given = a.parse_args()
    repo = given.repo.resolve()
    shard, of = map(int, given.shard.split("/"))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # restores the file
    earlier = given.out.read_text().splitlines() if given.out.exists() else []
    done = {(x["seed"], x["number"]) for x in map(json.loads, earlier)}
    files = sites_of(repo, given.only.split(","))
    for number, (what, text) in enumerate(drawn(files, given.number, given.seed)):
        words = f"{what['file']}:{what['line']}: {what['change']}"
        if given.list:
            print(number, what["kind"], words)
            continue
        if number % of != shard or (given.seed, number) in done:
            continue
        if given.until and datetime.now().strftime("%H:%M") >= given.until:
            break
        if what["kind"] == "arguments" and re.match(r"(max|min)\(", what["change"]):
            print(number, "equivalent", words, flush=True)  # NaN aside
            continue
        result = {"seed": given.seed, "number": number, **tried(given, repo, what, text)}
        with given.out.open("a") as file:
            file.write(json.dumps(result) + "\n")
        print(number, result["verdict"], result["s"], words, "|", result["by"], flush=True)


if __name__ == "__main__":
    sys.exit(main())
