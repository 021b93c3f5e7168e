#!/usr/bin/env python3
"""The check of docs/figures.py finds a figure that differs, a block that no program measures, and
a picture that no document shows. Every case changes a copy of the documents once."""
import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(sys.argv.pop(1))
sys.path.insert(0, str(ROOT / "docs"))
import figures  # noqa: E402
import figures_csv  # noqa: E402


class Check(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        shutil.copy(ROOT / "README.md", self.root)
        shutil.copytree(ROOT / "docs", self.root / "docs")

    def errors_after(self, document, change):
        path = self.root / document
        path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
        return "\n".join(figures.find_errors(self.root))

    def change_block(self, name, text):
        """Adds one to the block's first figure."""
        match = next(m for m in figures.BLOCK.finditer(text) if m[1] == name)
        cell = re.search(r"(?:\*\*|\b)(\d[\d.]*)(?= times|\*\*)", match[2])
        start, end = (match.start(2) + i for i in cell.span(1))
        return text[:start] + str(float(cell[1]) + 1) + text[end:]

    def test_documents_agree(self):
        self.assertEqual(figures.find_errors(ROOT), [])

    def test_figure_of_readme(self):
        for name in ("times-faster", "headline"):
            errors = self.errors_after("README.md", lambda text: self.change_block(name, text))
            self.assertIn(f"'{name}' differs", errors)

    def test_figure_of_performance(self):
        path = "docs/performance.md"
        errors = self.errors_after(path, lambda text: self.change_block("times-faster", text))
        self.assertIn("'times-faster' differs", errors)

    def test_figure_in_prose(self):
        errors = self.errors_after("README.md", lambda text: text + "It is 12,345 times as fast.\n")
        self.assertIn("12,345 is not a figure", errors)

    def test_unknown_block(self):
        block = "<!-- figures: nonsense -->\n1\n<!-- /figures -->\n"
        errors = self.errors_after("docs/guide.md", lambda text: text + block)
        self.assertIn("does not know the block 'nonsense'", errors)

    def test_open_block(self):
        errors = self.errors_after(
            "docs/guide.md", lambda text: text + "<!-- figures: python -->\n1\n"
        )
        self.assertIn("a block is not closed", errors)

    def test_picture_that_nothing_shows(self):
        (self.root / "docs/pictures/new.png").touch()
        self.assertIn("no document shows", "\n".join(figures.find_errors(self.root)))

    def test_numbers_have_two_digits(self):
        values = {0: "0", 0.01234: "0.012", 9.96: "10", 53.4: "53", 131: "130", 24242: "24,000"}
        for value, text in values.items():
            self.assertEqual(figures.number(value), text)


PRINTED = """
Two bodies; medians of 3

| method | triangles | update, ms | query, ms | faster than FCL |
| --- | ---: | ---: | ---: | ---: |
| FCL RSS | 10 | 8.00 | 4.00 | 1.00 |
| ours | 10 | {ours} | 2.00 | 0.50 |

| job | ours | FCL |
| --- | ---: | ---: |
| collide | 0.10 + 0.25 | 3.0 (1.2) |
"""


class Csv(unittest.TestCase):
    def rows(self, ours="1.00"):
        return {r[1:4]: r[4] for r in figures_csv.rows_of("part", PRINTED.format(ours=ours))}

    def test_only_times_are_rows(self):
        self.assertEqual(
            self.rows(),
            {
                ("Two bodies", "FCL RSS", "update, ms"): 8,
                ("Two bodies", "FCL RSS", "query, ms"): 4,
                ("Two bodies", "ours", "update, ms"): 1,
                ("Two bodies", "ours", "query, ms"): 2,
                ("Two bodies", "collide", "ours"): 0.35,
                ("Two bodies", "collide", "FCL"): 3,
            },
        )

    def compared(self, ours, others):
        """The names of slower rows, if ours takes `ours` and all rows of FCL `others` times."""
        with tempfile.TemporaryDirectory() as folder:
            for run, factor in (("old", 1), ("new", others)):
                with open(f"{folder}/{run}.csv", "w", encoding="utf-8") as file:
                    file.write(",".join(figures_csv.COLUMNS) + "\n")
                    for (table, row, column), time in self.rows().items():
                        if "FCL" in row + column:
                            time *= factor
                        elif run == "new" and "update" in column:
                            time *= ours
                        elif run == "new":
                            time *= factor
                        file.write(f'c,d,p,part,{table},{row},"{column}",{time}\n')
            return figures_csv.compare(f"{folder}/old.csv", f"{folder}/new.csv")

    def test_comparison(self):
        self.assertEqual(self.compared(1.1, 1), 0)
        self.assertEqual(self.compared(1.2, 1), 1)
        self.assertEqual(self.compared(1.2, 1.2), 0)  # the machine is slower
        self.assertEqual(self.compared(1, 0.5), 1)


if __name__ == "__main__":
    unittest.main()
