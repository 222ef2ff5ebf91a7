"""Verdicts for those who read them: a table, JUnit XML, GitHub annotations and a step summary."""

from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from tbatch.campaign.summary import columns

if TYPE_CHECKING:
    from tbatch.campaign.limits import Verdict

_PROPERTY = {"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"}
_MESSAGE = {"%": "%25", "\r": "%0D", "\n": "%0A"}


def verdicts_text(verdicts: Sequence["Verdict"]) -> str:
    """A table with a line for each verdict, and the count of those that failed."""
    rows = [["pass" if one.passed else "FAIL", one.limit, one.place] for one in verdicts]
    lines = columns(["", "limit", "where"], [], rows)
    told = [lines[0], *(f"{line}  {one.message}" for line, one in zip(lines[1:], verdicts, strict=True))]
    failed = sum(not one.passed for one in verdicts)
    return "\n".join([*told, f"{len(verdicts)} judged, {failed} failed"])


def junit_xml(verdicts: Sequence["Verdict"], campaign: str, properties: dict[str, str]) -> bytes:
    """A JUnit test suite: a test case for each verdict.

    Args:
        verdicts: The verdicts.
        campaign: Name of the campaign.
        properties: What the numbers rest on, by name.
    """
    failed = sum(not one.passed for one in verdicts)
    counts = {"tests": str(len(verdicts)), "failures": str(failed), "errors": "0", "skipped": "0"}
    root = ElementTree.Element("testsuites", {"name": "tbatch check", **counts})
    suite = ElementTree.SubElement(root, "testsuite", {"name": campaign, **counts})
    listed = ElementTree.SubElement(suite, "properties")
    for name, value in properties.items():
        ElementTree.SubElement(listed, "property", {"name": name, "value": value})
    for one in verdicts:
        case = ElementTree.SubElement(suite, "testcase", {"classname": f"{campaign}.{one.place}", "name": one.limit})
        told = one.message + (f" (limit from: {one.source})" if one.source else "")
        if one.passed:
            ElementTree.SubElement(case, "system-out").text = told
        else:
            ElementTree.SubElement(case, "failure", {"message": told, "type": "limit"}).text = told
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"


def github_annotations(verdicts: Sequence["Verdict"], campaign: str) -> list[str]:
    """A workflow command for each failure."""
    lines = []
    for one in verdicts:
        if not one.passed:
            title = _escaped(f"{campaign}: {one.limit} at {one.place}", _PROPERTY)
            lines.append(f"::error title={title}::{_escaped(one.message, _MESSAGE)}")
    return lines


def step_summary(verdicts: Sequence["Verdict"], campaign: str, facts: str) -> str:
    """The verdicts as Markdown, the failed ones first."""
    failed = sum(not one.passed for one in verdicts)
    head = f"### tbatch check: {campaign}: " + ("all limits kept" if not failed else f"{failed} limits exceeded")
    rows = [
        f"| {'✅' if one.passed else '❌'} | `{one.limit}` | {one.place} | {_cell(one.message)} | {_cell(one.source)} |"
        for one in sorted(verdicts, key=lambda one: one.passed)
    ]
    return "\n".join([head, "", facts, "", "| | limit | where | found | source |", "|---|---|---|---|---|", *rows, ""])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _escaped(text: str, replaced: dict[str, str]) -> str:
    return "".join(replaced.get(letter, letter) for letter in text)
