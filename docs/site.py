"""Writes what doxygen makes the site of (docs/site.sh): each section of the guide as a page, with the
programs in C++ and Python side by side; the other documents; Python's reference; recorded runs.

    site.py PROJECT FOLDER RUNS
"""
import ast
import re
import sys
from pathlib import Path

FENCED = re.compile(r"^```(\w*)\n(.*?)^```\n", re.M | re.S)
RUNS = {
    "helmet": "Bounding volumes that follow a deforming helmet: press V, then + and −.",
    "clearance": "The clearance of a hose that swings, as colours on its surface.",
    "gripper": "Two soft fingers lift a ball: contact forces as arrows.",
}


def slug(title):
    """The name of a heading in links, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def sections(text):
    """[(level, title, body)] of the headings # and ## outside of programs."""
    held, found = {}, []

    def hold(match):
        held[f"\x00{len(held)}\x00"] = match.group(0)
        return f"\x00{len(held) - 1}\x00"

    def give(part):
        return re.sub("\x00\\d+\x00", lambda m: held[m.group(0)], part)

    parts = re.split(r"^(#{1,2}) (.+)\n", FENCED.sub(hold, text), flags=re.M)
    for hashes, title, body in zip(parts[1::3], parts[2::3], parts[3::3]):
        found.append((len(hashes), title, give(body)))
    return found


def html(text):
    return f"\n@htmlonly[block]\n{text}\n@endhtmlonly\n"


def side_by_side(body, of_python):
    """The body of a section, with the program in Python beside its first program in C++."""
    programs = [m for m in FENCED.finditer(body) if m.group(1) == "cpp" and "int main(" in m.group(2)]
    if not programs or not of_python:
        return body
    start = end = programs[0].start()
    end = programs[0].end()
    output = re.compile(r"\n*```text\n.*?^```\n", re.M | re.S).match(body, end)
    if output:
        end = output.end()
    columns = "".join(
        html(f'<div class="column"><p class="language">{language}</p>') + "\n" + code + html("</div>")
        for language, code in (("C++", body[start:end]), ("Python", of_python.strip() + "\n"))
    )
    return body[:start] + html('<div class="pair">') + columns + html("</div>") + body[end:]


def write_guide(project, folder):
    guide = sections((project / "docs/guide.md").read_text())
    python = {title: body for _, title, body in sections((project / "docs/guide_python.md").read_text())}
    missing = set(python) - {title for _, title, _ in guide} - {"The guide's programs in Python"}
    assert not missing, f"guide_python.md has sections that guide.md has not: {missing}"
    names = {slug(title): f"guide_{slug(title).replace('-', '_')}" for _, title, _ in guide}
    # Headings below a section lead to its page.
    for _, title, body in guide:
        for lower in re.findall(r"^###+ (.+)$", body, re.M):
            names.setdefault(slug(lower), names[slug(title)])

    def linked(text):
        to_page = lambda m: f"](@ref {names[m.group(1)]})" if m.group(1) in names else "](@ref guide)"
        text = re.sub(r"\]\((?:guide\.md)?#([\w-]+)\)", to_page, text)
        text = text.replace("](guide_python.md)", "](@ref guide)")
        return re.sub(r"\]\((\w+\.md)#[\w-]+\)", r"](\1)", text)

    contents = "# Guide {#guide}\n\n"
    for level, title, body in guide:
        if level == 1 and title == "Guide":
            contents += linked(re.sub(r"^\|.*\n", "", body, flags=re.M))
            continue
        if level == 1:
            contents += f"\n**{title}**\n\n"
            continue
        page = names[slug(title)]
        contents += f"- @subpage {page}\n"
        text = linked(side_by_side(body, python.get(title, "")))
        text = re.sub(r"^###", "##", text, flags=re.M)
        (folder / f"{page}.md").write_text(f"# {title} {{#{page}}}\n{text}")
    (folder / "guide.md").write_text(contents)
    return linked


def write_runs(folder, runs):
    text = "# Recorded runs {#runs}\n\nPages that `Recording` writes: they play here. Drag turns the view.\n"
    for name, caption in RUNS.items():
        if (runs / f"{name}.html").exists():
            link = f'@htmlonly<a href="runs/{name}.html">Open it alone</a>@endhtmlonly'
            text += f"\n{caption} {link}\n"
            text += html(f'<iframe class="run" src="runs/{name}.html" title="{caption}" '
                         'loading="lazy"></iframe>')
    (folder / "runs.md").write_text(text)


class Documented(ast.NodeTransformer):
    """Puts the docstrings of the module behind the names of its stub."""

    def __init__(self, module):
        self.owners = [module]

    def documented(self, node):
        found = getattr(self.owners[-1], node.name, None)
        text = (getattr(found, "__doc__", None) or "").strip()
        if found is not None and text and not node.name.startswith("_"):
            text = re.sub(r"^(\w+\(.*\n)+\n?", "", text)  # pybind11's line with the signature
            node.body = [ast.Expr(ast.Constant(text))] + node.body
        return found

    def visit_ClassDef(self, node):
        self.owners.append(self.documented(node))
        self.generic_visit(node)
        self.owners.pop()
        return node

    def visit_FunctionDef(self, node):
        if any(isinstance(d, ast.Name) and d.id == "overload" for d in node.decorator_list):
            node.decorator_list = []
        self.documented(node)
        return node


def write_python_reference(project, folder):
    try:
        import adaptive_bvh as module
    except ImportError:
        print("site.py: no Python module, leaving out its reference", file=sys.stderr)
        return
    stub = ast.parse((project / "python/adaptive_bvh/__init__.pyi").read_text())
    keep = (ast.ClassDef, ast.FunctionDef)
    stub.body = [node for node in stub.body if isinstance(node, keep) and not node.name.startswith("_")]
    stub = ast.fix_missing_locations(Documented(module).visit(stub))
    text = f'"""The Python module: import adaptive_bvh as ab."""\n\n{ast.unparse(stub)}\n'
    (folder / "ab.py").write_text(text)


def main(project, folder, runs):
    linked = write_guide(project, folder)
    write_runs(folder, runs)
    for document in [project / "README.md", *(project / "docs").glob("*.md")]:
        if document.stem in ("guide", "guide_python"):
            continue
        text = re.sub(r"\]\(docs/", "](", document.read_text())
        text = re.sub(r"^#+ .*$", lambda m: m.group(0).replace("`", ""), text, flags=re.M)
        if document.stem == "README":
            text += "\nNext: the [guide](@ref guide), [recorded runs](@ref runs).\n"
        (folder / document.name).write_text(linked(text))
    write_python_reference(project, folder)


main(*map(Path, sys.argv[1:]))
