"""The table of docs/accuracy.md: pytest tests/proof --junitxml proof.xml && python docs/accuracy_table.py proof.xml."""

import sys
import xml.etree.ElementTree as ElementTree


def rows(path: str) -> list[str]:
    """A line a checked quantity, with its error and tolerance; the worst of a test's variants."""
    worst: dict[tuple[str, str, str], tuple[float, float]] = {}
    for case in ElementTree.parse(path).iter("testcase"):
        module = case.get("classname", "").rpartition(".")[2]
        name = case.get("name", "").partition("[")[0]
        for entry in case.iter("property"):
            error, tolerance = map(float, (entry.get("value") or "nan of nan").split(" of "))
            key = module, name, entry.get("name", "")
            if key not in worst or error / tolerance > worst[key][0] / worst[key][1]:
                worst[key] = error, tolerance
    lines = ["| case | quantity | error | tolerance |", "|---|---|---:|---:|"]
    before = ""
    for (_, name, quantity), (error, tolerance) in worst.items():
        told = name.removeprefix("test_").replace("_", " ")
        # A negative excess lies within its bounds.
        lines.append(f"| {told if told != before else ''} | {quantity} | {max(error, 0.0):.1e} | {tolerance:.1e} |")
        before = told
    return lines


if __name__ == "__main__":
    print("\n".join(rows(sys.argv[1])))
