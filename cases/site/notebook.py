"""Run the notebook of the gallery, and show it as a page of the site.

    python cases/site/notebook.py

runs its cells anew and writes their outputs; a test compares them with those of a new run. Sphinx
gets the notebook as Markdown: no package for notebooks is needed to build the site.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
from base64 import b64encode
from pathlib import Path
from typing import Any

NOTEBOOK = Path(__file__).with_suffix(".ipynb")
FORMS = {"text/html": "_repr_html_", "image/png": "_repr_png_"}
Outputs = list[dict[str, Any]]


def read() -> dict[str, Any]:
    """The notebook as it is stored."""
    content: dict[str, Any] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return content


def code_cells(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    """The cells with code, in their order."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run(source: str, names: dict[str, Any], count: int) -> Outputs:
    """Outputs of a cell as Jupyter stores them: what it prints, and its last expression."""
    tree, printed = ast.parse(source), io.StringIO()
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, NOTEBOOK.name, "exec"), names)
        value = eval(ast.unparse(last), names) if last else None
    outputs: Outputs = []
    if text := printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": text})
    if value is not None:
        data = {"text/plain": repr(value)}
        for form, method in FORMS.items():
            shown = getattr(value, method, lambda: None)()
            if shown is not None:
                data[form] = b64encode(shown).decode() if isinstance(shown, bytes) else shown
        result = {"output_type": "execute_result", "data": data, "metadata": {}}
        outputs.append({**result, "execution_count": count})
    return outputs


def markdown() -> str:
    """The notebook as Markdown, pictures and tables within it."""
    parts = []
    for cell in read()["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else _block("python", source))
        parts += [_shown(each) for each in cell.get("outputs", ())]
    return "\n\n".join(parts)


def _shown(output: dict[str, Any]) -> str:
    data = output.get("data", {"text/plain": output.get("text", "")})
    if picture := data.get("image/png"):
        tag = f'<img alt="Figure of the cell above" src="data:image/png;base64,{picture}">'
        return _block("{raw} html", tag)
    if table := data.get("text/html"):
        return _block("{raw} html", f'<div class="notebook">{table}</div>')
    return _block("text", data["text/plain"])


def _block(kind: str, text: str) -> str:
    return f"```{kind}\n{text.strip()}\n```"


def main() -> None:
    """Run all cells and write the notebook."""
    notebook, names = read(), dict[str, Any]()
    for count, cell in enumerate(code_cells(notebook), start=1):
        cell["execution_count"] = count
        cell["outputs"] = run("".join(cell["source"]), names, count)
    text = json.dumps(notebook, indent=1, ensure_ascii=False)
    NOTEBOOK.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
