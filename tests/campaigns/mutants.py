"""
Random mutants of scanfab, one at a time, and whether its tests catch them.

    python tests/campaigns/mutants.py REPO PYTHON NUMBER SEED [--only room,room] [--jobs N] ...

REPO is a scratch copy: its files are changed and restored. PYTHON has scanfab[test] installed from
it. The same seed gives the same mutants of the same code, another seed others, so that several
copies can work at once. Results are lines of JSON in --out; mutants that are there are not tried
again. About 45 s a mutant on one core; a mutant that runs into its time limit is not killed yet.
"""

import argparse
import ast
import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

SECONDS = 240  # for the tests of a mutant; of kernels twice as many
ROOMS = "base,scan,packing,fabric,io,table,pipeline,viz,cli"
REACHING = ("tests/cli/test_compute.py", "tests/identities", "tests/pipeline")
# functions that only make texts, and calls that only say something
QUIET = {"__repr__", "__str__", "_repr_html_"}
SPOKEN = {"warn", "note", "isinstance", "TypeVar", "cast"}
ARITHMETIC = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
COMPARED = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.GtE), ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE), ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
}  # fmt: skip
TYPES = re.compile(r"\bNone\b|\b[A-Z][a-z]|\b(str|int|float|bool)\b")


def spelt(node):
    """A node's text, in brackets, so that it may stand anywhere in an expression."""
    return f"({ast.unparse(node)})"


def is_text(node):
    """Whether a node is a text: a constant, or with values filled in."""
    return isinstance(node, ast.JoinedStr) or isinstance(getattr(node, "value", None), str)


def of_conditions(node):
    """Other constants, and the opposite of a condition: kind, the replaced node, and the text."""
    match node:
        case ast.Constant(value=bool(value)):
            yield "constant", node, str(not value)
        case ast.Constant(value=int(value)):
            yield "constant", node, str(value + 1)
        case ast.Constant(value=float(value)):
            yield "constant", node, repr(value * 1.1) if value else "1.0"
        case ast.If() | ast.While() | ast.IfExp() | ast.comprehension():
            for test in getattr(node, "ifs", None) or [getattr(node, "test", None)]:
                if test is not None and "TYPE_CHECKING" not in ast.unparse(test):
                    yield "negate", test, f"(not {spelt(test)})"
        case ast.BoolOp(op=op, values=values):
            other = ast.Or() if isinstance(op, ast.And) else ast.And()
            yield "negate", node, spelt(ast.BoolOp(other, values))


def of_operations(node):
    """Other signs and operations."""
    match node:
        case ast.Compare(left=left, ops=signs, comparators=terms):
            for place, sign in enumerate(signs):
                for other in COMPARED[type(sign)]:
                    changed = [*signs[:place], other(), *signs[place + 1 :]]
                    yield "comparison", node, spelt(ast.Compare(left, changed, terms))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
            # texts and lists know only some of the operations, and types only that one
            lists = ast.List | ast.Tuple | ast.ListComp
            is_type = isinstance(op, ast.BitOr) and TYPES.search(ast.unparse(node))
            if not is_type and not any(is_text(x) or isinstance(x, lists) for x in (left, right)):
                yield "arithmetic", node, spelt(ast.BinOp(left, ARITHMETIC[type(op)](), right))


def of_statements(node):
    """Steps and calls that are left out or done backwards, and other answers."""
    match node:
        case ast.AugAssign(target=target, op=op, value=value):
            yield "drop", node, "pass"
            if type(op) in ARITHMETIC and not is_text(value):
                step = ast.AugAssign(target, ARITHMETIC[type(op)](), value)
                yield "arithmetic", node, ast.unparse(step)
        case ast.Expr(value=ast.Call()):
            yield "drop", node, "pass"
        case ast.Return(value=ast.Tuple(elts=[one, two, *more])) if not starred(ast.walk(node)):
            swapped = ast.Tuple([two, one, *more], ast.Load())
            yield "return", node, f"return {spelt(swapped)}"
        case ast.Return(value=ast.Compare() | ast.BoolOp()):
            yield "return", node, f"return not {spelt(node.value)}"
        case ast.Return(value=None | ast.Constant() | ast.JoinedStr()):
            pass
        case ast.Return():
            yield "return", node, "return None"


def of_calls(node):
    """Two arguments in each other's place."""
    match node:
        # of all values but NaN the larger one is the same in any order
        case ast.Call(func=ast.Name(id="max" | "min")):
            pass
        case ast.Call(func=func, args=args, keywords=named) if not starred(args):
            for k in range(len(args) - 1):
                one, two = args[k : k + 2]
                if ast.unparse(one) != ast.unparse(two):
                    changed = [*args[:k], two, one, *args[k + 2 :]]
                    yield "arguments", node, ast.unparse(ast.Call(func, changed, named))


def starred(nodes):
    """Whether a list is unpacked in one of them."""
    return any(isinstance(one, ast.Starred) for one in nodes)


def is_left_alone(node):
    """What only says something, or takes from elsewhere."""
    if isinstance(node, ast.Call):
        return ast.unparse(node.func).rpartition(".")[2] in SPOKEN
    said = isinstance(node, ast.Expr) and is_text(node.value)
    quiet = isinstance(node, ast.FunctionDef) and node.name in QUIET
    kinds = ast.Raise | ast.Assert | ast.Import | ast.ImportFrom | ast.JoinedStr
    return said or quiet or isinstance(node, kinds)


def sites(tree, bound=None):
    """All mutants of a file: kind, the node that is replaced, and the text in its place."""
    bound = bound or {}
    if isinstance(tree, ast.FunctionDef):
        names = [(one.arg, one.lineno) for one in ast.walk(tree.args) if isinstance(one, ast.arg)]
        names += [
            (one.id, one.lineno)
            for one in ast.walk(tree)
            if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)
        ]
        bound = dict(sorted(names, key=lambda one: -one[1]))  # the first line of each name counts
    if isinstance(tree, ast.Assign):
        names = [x.id for one in tree.targets for x in ast.walk(one) if isinstance(x, ast.Name)]
        # without a value of its own before, the name would only be missing
        if all(bound.get(name, tree.lineno) < tree.lineno for name in names):
            yield "drop", tree, "pass"
    for mutants in (of_conditions, of_operations, of_statements, of_calls):
        yield from mutants(tree)
    for name, value in ast.iter_fields(tree):
        for one in value if isinstance(value, list) else [value]:
            is_type = name in ("annotation", "returns", "decorator_list")
            if isinstance(one, ast.AST) and not is_type and not is_left_alone(one):
                yield from sites(one, bound)


def drawn(repo, rooms, number, seed):
    """So many different mutants: what they are, and the text of their file."""
    files = {}
    for path in sorted(x for room in rooms for x in (repo / "scanfab" / room).rglob("*.py")):
        text, kinds = path.read_text(), {}
        for kind, node, new in sites(ast.parse(text)):
            kinds.setdefault(kind, []).append((node, new))
        if kinds:
            files[str(path.relative_to(repo))] = text, kinds
    names, chance, found = sorted(files), random.Random(seed), {}
    weights = [files[name][0].count("\n") for name in names]
    while len(found) < number:
        name = chance.choices(names, weights)[0]
        text, kinds = files[name]
        kind = chance.choice(sorted(kinds))
        node, new = chance.choice(kinds[kind])
        raw = text.encode()
        begins = [0]
        for line in raw.splitlines(keepends=True):
            begins.append(begins[-1] + len(line))
        start = begins[node.lineno - 1] + node.col_offset
        end = begins[node.end_lineno - 1] + node.end_col_offset
        mutated = (raw[:start] + new.encode() + raw[end:]).decode()
        ast.parse(mutated)
        change = "  ->  ".join(" ".join(x.split())[:160] for x in (raw[start:end].decode(), new))
        what = {"file": name, "line": node.lineno, "kind": kind, "change": change}
        found.setdefault((name, mutated), (what, mutated))
    return [*found.values()]


def is_kernel(name):
    """Whether a file is compiled, which takes minutes."""
    return "/kernels/" in name or name.endswith("/kernels.py")


def stages(repo, name):
    """Tests near the module, then those of the room, then what reaches it."""
    parts = Path(name).with_suffix("").parts[1:]
    room, module = f"tests/{parts[0]}", ".".join(("scanfab", *parts))
    texts = {x: x.read_text() for x in sorted((repo / room).rglob("test_*.py"))}
    near = [x for x in texts if x.stem == f"test_{parts[-1]}"]
    near += [x for x in texts if x not in near and re.search(rf"\b{module}\b", texts[x])]
    near = [str(x.relative_to(repo)) for x in near if x.parent.name != "cluster"]
    # pytest would take a folder and its own file as the folder, in its usual order
    first = [room, *(f"--ignore={x}" for x in near)]
    # some tests run kernels as plain Python
    uncompiled = [[room, "-k", "uncompiled"]] if is_kernel(name) else []
    return [*uncompiled, *([near] if near else []), first, [x for x in REACHING if x != room]]


def run_tests(repo, python, paths, limit, jobs):
    """Exit code of pytest, None after too long; its output; and the seconds it took."""
    words = [python, "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider"]
    if "tests/pipeline" in paths:
        words.append("--ignore=tests/pipeline/cluster")  # schedulers start for minutes
    env = {**os.environ, "PYTHONPATH": str(repo), "PYTHONDONTWRITEBYTECODE": "1"}
    began = time.time()
    with subprocess.Popen(
        [*words, "-n", str(jobs), "--tb=line", *paths], cwd=repo, env=env, text=True,
        start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as done:  # fmt: skip
        try:
            text, code = done.communicate(timeout=max(limit, 1))[0], done.returncode
        except subprocess.TimeoutExpired:
            text, code = "", None
        finally:
            if done.poll() is None:
                os.killpg(done.pid, signal.SIGKILL)
    return code, text, time.time() - began


def judged(repo, python, name, limit, jobs):
    """How the tests take a mutant: verdict, the test that killed it, seconds of each stage."""
    spent = []
    for paths in stages(repo, name):
        code, text, took = run_tests(repo, python, paths, limit - sum(spent), jobs)
        spent.append(round(took, 1))
        if code is None:
            return "timeout", "", spent
        if code and not (code == 5 and "-k" in paths):  # 5: there are none
            lines = text.strip().splitlines()
            failed = [x for x in lines if x.startswith(("FAILED", "ERROR"))]
            return "killed", (failed or lines[-1:] or [f"exit code {code}"])[0][:200], spent
    return "survived", "", spent


def main():
    """Try each mutant that is not in the file of results yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("repo", type=Path)
    parser.add_argument("python")
    parser.add_argument("number", type=int)
    parser.add_argument("seed", type=int)
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    parser.add_argument("--jobs", type=int, default=2, help="pytest -n")
    parser.add_argument("--only", default=ROOMS)
    given = parser.parse_args()
    repo = given.repo.resolve()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # restores the file
    earlier = given.out.read_text().splitlines() if given.out.exists() else []
    done = {(x["seed"], x["number"]) for x in map(json.loads, earlier)}
    mutants = drawn(repo, given.only.split(","), given.number, given.seed)
    for number, (what, text) in enumerate(mutants):
        if (given.seed, number) not in done:
            path, limit = repo / what["file"], SECONDS * (1 + is_kernel(what["file"]))
            before = path.read_text()
            try:
                path.write_text(text)
                verdict, by, spent = judged(repo, given.python, what["file"], limit, given.jobs)
            finally:
                path.write_text(before)
            result = {"seed": given.seed, "number": number, **what, "verdict": verdict, "by": by}
            with given.out.open("a") as file:
                file.write(json.dumps(result) + "\n")
            print(spent, *result.values(), flush=True)


if __name__ == "__main__":
    main()
