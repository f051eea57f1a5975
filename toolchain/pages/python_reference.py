"""Reference page of the Python package, from its source: signatures and docstrings of the public names."""
import ast
import os
import re


def public_names(folder):
    """Names in __all__, each with the module that defines it, and its name there."""
    with open(os.path.join(folder, "__init__.py")) as file:
        tree = ast.parse(file.read())
    defined = {a.asname or a.name: (node.module, a.name) for node in tree.body if isinstance(node, ast.ImportFrom) for a in node.names}
    names = next(ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == "__all__")
    return ast.get_docstring(tree), [(name, *defined[name]) for name in names if not name.startswith("__")]


def text_of(docstring):
    """Docstring as Markdown: examples (lines after >>>) become code blocks."""
    out = []
    for paragraph in (docstring or "").split("\n\n"):
        is_example = paragraph.lstrip().startswith(">>>")
        out.append(f"```pycon\n{paragraph}\n```" if is_example else paragraph.replace("<", "&lt;"))
    return "\n\n".join(out)


def signature(node, name):
    """Code block with the call; without the arguments self and cls."""
    arguments = re.sub(r"^(self|cls)(, |$)", "", ast.unparse(node.args))
    result = f" -> {ast.unparse(node.returns)}" if node.returns and node.name != "__init__" else ""
    line = f"{name}({arguments}){result}"
    if len(line) > 100:
        line = f"{name}(\n" + "".join(f"    {part},\n" for part in re.split(r", (?=[*a-z])", arguments)) + f"){result}"
    return f"```python\n{line}\n```"


def fields(node):
    """List of the fields of a class and the values of an enumeration."""
    for item in node.body:
        if isinstance(item, ast.AnnAssign):
            yield f"- `{item.target.id}: {ast.unparse(item.annotation)}`"
        elif isinstance(item, ast.Assign) and isinstance(item.targets[0], ast.Name) and not item.targets[0].id.startswith("_"):
            yield f"- `{item.targets[0].id}`"


def methods(node):
    """Constructor, and sections of the public methods and properties of a class."""
    for item in node.body:
        if isinstance(item, ast.FunctionDef) and item.name == "__init__":
            yield signature(item, node.name)
        elif isinstance(item, ast.FunctionDef) and not item.name.startswith("_"):
            is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in item.decorator_list)
            yield f"### {node.name}.{item.name}\n\n" + ("" if is_property else signature(item, item.name) + "\n\n") + text_of(ast.get_docstring(item))


def section(name, tree, public_name):
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return f"{signature(node, public_name)}\n\n{text_of(ast.get_docstring(node))}"
        if isinstance(node, ast.ClassDef) and node.name == name:
            return "\n\n".join([text_of(ast.get_docstring(node)), "\n".join(fields(node)), *methods(node)])
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", None) == name:
            return f"```python\n{public_name} = {ast.unparse(node.value)}\n```"
    raise ValueError(f"no definition of {name}")


def page(folder):
    docstring, names = public_names(folder)
    parts = [f"# Python interface\n\n{text_of(docstring)}\n\nBuild and examples: [Python package](../board/python/README.md)."]
    for name, module, own_name in names:
        with open(os.path.join(folder, module + ".py")) as file:
            parts.append(f"## {name}\n\n{section(own_name, ast.parse(file.read()), name)}")
    return "\n\n".join(parts) + "\n"
