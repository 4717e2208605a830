"""JUnit XML: a suite a mesh, a case a rule and zone; what Jenkins, GitLab and Azure DevOps show as tests."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET

from meshwright.audit.places import text
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.results import LONGEST, Result, results
from meshwright.reports.wording import name

__all__ = ["render", "xml_text"]

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def xml_text(value: str) -> str:
    """A text that XML can hold: characters it knows no way to write are escaped as in Python."""
    return _NOT_XML.sub(lambda match: match[0].encode("unicode_escape", "replace").decode("ascii"), text(value))


def render(batch: Batch, page: Page) -> str:
    """The file: failures for broken rules, errors for what could not be checked, skipped for what is waived."""
    del page
    root = ET.Element("testsuites", name="meshwright")
    suites: dict[str, list[Result]] = {}
    for result in results(batch):
        suites.setdefault(result.mesh, []).append(result)
    for document in batch.documents:
        suites.setdefault(document["mesh"]["path"] or "mesh", [])
    for number, (mesh, found) in enumerate(suites.items()):
        _suite(root, number, mesh, found)
    for key in ("tests", "failures", "errors"):
        root.set(key, str(sum(int(suite.get(key, "0")) for suite in root)))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _suite(root: ET.Element, number: int, mesh: str, found: list[Result]) -> None:
    """The cases of one mesh; one that no rule and no finding speaks of has a case that it was read."""
    shown = xml_text(name(mesh, LONGEST))
    found = found or [Result(mesh, "audit", "audit", "", "pass", "measured and checked: nothing found")]
    counts = {
        "tests": len(found),
        "failures": sum(r.state == "fail" for r in found),
        "errors": sum(r.state == "incomplete" for r in found),
        "skipped": sum(r.state == "waived" for r in found),
    }
    suite = ET.SubElement(
        root, "testsuite", {"name": shown, "id": str(number), **{k: str(n) for k, n in counts.items()}}
    )
    for result in found:
        title = result.rule + (f" [{name(result.zone, LONGEST)}]" if result.zone else "")
        case = ET.SubElement(suite, "testcase", name=xml_text(title), classname=shown, time="0")
        message = xml_text(name(result.message, 10 * LONGEST))
        kinds = {"fail": "failure", "incomplete": "error", "waived": "skipped"}
        if result.state in kinds:
            child = ET.SubElement(case, kinds[result.state])
            child.text = message
            if result.state != "waived":  # the schema knows no attributes of `skipped`
                child.set("message", message)
                child.set("type", result.rule if result.state == "fail" else "incomplete")
        out = [message] if result.state in ("warn", "info", "pass") else []
        out += [f"state: {result.state}"] + ([f"source: {xml_text(name(result.source, 300))}"] if result.source else [])
        ET.SubElement(case, "system-out").text = "\n".join(out)
