"""What the code says of commands, options and columns, as Markdown for the pages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from textwrap import dedent

import click

from scanfab.base.column import Column
from scanfab.cli.group import COMMANDS, cli
from scanfab.cli.options import TITLES
from scanfab.pipeline.calibration import STEP_COLUMNS
from scanfab.pipeline.inspection import REPORT_COLUMNS
from scanfab.pipeline.options import DECLARED
from scanfab.table.columns import MORE_COLUMNS, OWN_COLUMNS, map_columns
from scanfab.table.compare import DIFFERENCES, FRAMES, SUMMARY

COMPONENT = re.compile(
    r"\b([xyz]{1,2}|\d)\b|(?<=_)\d\b|\b(void|contact) fabric\b|\balpha_(vs|c)_axial\b"
    r"|(?<=without the )(segments|contacts)|\b(strong|weak)(?= contacts$)"
    r"|the (largest|middle one|smallest)$"
)
# what a line says of several columns, in place of what it says of the first of them
FOR_SEVERAL = (
    (r"^(xx|x) of (the )?", ""),
    (r"_1\b", "_N"),
    (r"octant 1 \(at", "octant N (1 is at"),
    (r"the largest$", "the largest first"),
    (r"strong contacts$", "strong or weak contacts"),
    (r"order 2\b", "order 2 or 4"),
)
COLUMNS: dict[str, tuple[Column, ...]] = {
    "`scanfab compute`": OWN_COLUMNS,
    "`scanfab compute` with further options": MORE_COLUMNS,
    "`scanfab map`": map_columns(("edge",), shells=True),
    "`scanfab compare`": FRAMES,
    "`scanfab compare --summary`": SUMMARY,
    "`scanfab compare --differences`": DIFFERENCES,
    "`scanfab calibrate`": STEP_COLUMNS,
    "`scanfab inspect --json`": REPORT_COLUMNS,
}


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def command(name: str) -> click.Command:
    found = cli.get_command(click.Context(cli), name)
    assert found is not None
    return found


def commands() -> str:
    """The help of each command without its options."""
    parts = []
    for name in COMMANDS:
        usage = " ".join(command(name).collect_usage_pieces(click.Context(command(name))))
        parts.append(f"### scanfab {name}\n\n`scanfab {name} {usage}`\n")
        for paragraph in dedent(command(name).help or "").split("\n\n"):
            is_block = paragraph.startswith("\b\n")
            text = paragraph.removeprefix("\b\n")
            parts.append(f"```text\n{text}\n```\n" if is_block else f"{as_code(text)}\n")
    return "\n".join(parts)


def all_options() -> dict[str, dict[tuple[str, str], list[str]]]:
    """By the name of an option: its form and help, and the commands that have it so."""
    found: dict[str, dict[tuple[str, str], list[str]]] = {}
    for name in COMMANDS:
        context = click.Context(command(name))
        for parameter in command(name).params:
            record = parameter.get_help_record(context)
            if isinstance(parameter, click.Option) and record is not None:
                kinds = found.setdefault(parameter.opts[0], {})
                kinds.setdefault((record[0], record[1]), []).append(name)
    return found


def group_of(option: str) -> str:
    """The group in which the help lists an option."""
    declared = {one.flag: one.group for one in DECLARED.values()}
    return declared.get(option, "output")


def options() -> str:
    """Every option once, in groups; where commands differ in it, what it is for each of them."""
    parts = []
    for group, title in list(TITLES.items())[1:]:
        chosen = {name: kinds for name, kinds in all_options().items() if group_of(name) == group}
        parts.append(f"### {title}\n\n" + "\n".join(definition(*one) for one in chosen.items()))
    return "\n".join(parts)


def definition(option: str, kinds: dict[tuple[str, str], list[str]]) -> str:
    """An option with what it means."""
    (form, text), *others = kinds
    span = f"[`{form}`]{{#{option.lstrip('-')}}}"
    lines = [f"{span}\n: {escaped(text)}\n"]
    for other_form, other_text in others:
        who = ", ".join(f"`{name}`" for name in kinds[other_form, other_text])
        new = f"`{other_form}`: " if other_form != form else ""
        same = default_alone(text, other_text)
        lines.append(f"\n  {who}: {new}{same or escaped(other_text)}\n")
    return "".join(lines)


def default_alone(text: str, other: str) -> str:
    """The default of an option in another command, if they differ in nothing else."""
    (before, _, _), (same, _, default) = (
        text.partition("  [default: "),
        other.partition("  [default: "),
    )
    return f"default {default.rstrip(']')}." if before == same else ""


def escaped(text: str) -> str:
    """Help as Markdown."""
    for sign in "*_<>[]|":
        text = text.replace(sign, "\\" + sign)
    return as_code(text.replace("  \\[", " \\["))


def as_code(text: str) -> str:
    """A text whose options are set as code, so that no line breaks inside them."""
    return re.sub(r"(?<![\w-])--[a-z][a-z-]+", r"`\g<0>`", text)


def taken() -> str:
    """Which command takes which option."""
    rows = [
        [f"[`{option}`](#{option.lstrip('-')})", *marks(kinds)]
        for option, kinds in all_options().items()
    ]
    return markdown(["option", *COMMANDS], sorted(rows))


def marks(kinds: dict[tuple[str, str], list[str]]) -> Iterator[str]:
    takers = {name for names in kinds.values() for name in names}
    return ("●" if name in takers else "" for name in COMMANDS)


def columns() -> str:
    """What the columns of each table hold; a table does not repeat what one above has."""
    parts, told = [], dict[str, str]()
    for title, listed in COLUMNS.items():
        # what a frame holds is counted otherwise than in the fabric table
        is_new = {one: told.get(one.name) != one.meaning for one in listed}
        if "compare" in title or "calibrate" in title:
            is_new = {one: one.name not in told for one in listed}
        told = {one.name: one.meaning for one in listed} | told
        alike: dict[str, list[Column]] = {}
        for one in listed:
            if is_new[one]:
                alike.setdefault(without_component(one), []).append(one)
        rows = [row(group) for group in alike.values()]
        parts.append(f"## {title}\n\n{markdown(['column', 'what it holds (unit)'], rows)}")
        if again := [f"`{one.name}`" for one in listed if not is_new[one]]:
            names = re.sub(r"(`\w+_)xx`, (?:\1\w\w`, )*(\1yz`)", r"\1xx` to \2", ", ".join(again))
            parts.append(f"As above: {names}.\n")
    return "\n".join(parts)


def without_component(column: Column) -> str:
    """The meaning without the component, octant, number or fabric; a tensor has its own line."""
    tensor = column.name.rpartition("_")[0] if "tensor" in column.meaning else ""
    return tensor + COMPONENT.sub("", re.sub(r" \(at -x.*", "", column.meaning))


def row(alike: list[Column]) -> list[str]:
    """A line of the table for columns that differ in their component or fabric alone."""
    names = ", ".join(f"`{one.name}`" for one in alike)
    meaning = alike[0].meaning.removeprefix("of a map: ")
    if len(alike) > 1:
        for pattern, words in FOR_SEVERAL:
            meaning = re.sub(pattern, words, meaning)
    of = alike[0].name.removesuffix("_se") if len(alike) == 1 else "the column without _se"
    meaning = re.sub("^its standard error", f"standard error of {of}", meaning)
    if any("contact fabric" in one.meaning for one in alike[1:]):
        meaning = re.sub(r"(the )?void fabric\b", "void or contact fabric", meaning)
    if "alpha_vs_axial" in meaning and any("alpha_c_axial" in one.meaning for one in alike[1:]):
        meaning = meaning.replace("alpha_vs_axial", "alpha_vs_axial or alpha_c_axial")
        meaning = meaning.replace("the segments", "the segments or contacts")
    unit = f" ({alike[0].unit})" if alike[0].unit else ""
    return [names, escaped(meaning) + unit]
