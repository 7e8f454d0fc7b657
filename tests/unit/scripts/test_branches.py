"""What counts as a branch and as a code line."""

from pathlib import Path

import pytest

from scripts.branches import Count, code_lines, count, functions, main

EVERY_BRANCH = '''"""A docstring
of two lines."""

# a comment
def outer(xs, a, b, c):
    """Its docstring."""
    if a and b or c:  # if, and, or
        return 1
    elif b:  # elif
        return 2
    for x in xs:  # for
        while x:  # while
            x -= 1
    try:
        y = 1 if a else 2  # conditional expression
    except ValueError:  # except
        y = [x for x in xs if x if x > 1]  # two conditions
    match y:
        case 1:  # case
            pass
    def inner():
        return a or b  # or, inner's own
    return inner
'''


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("if a:\n    pass\n", 1),
        ("if a:\n    pass\nelif b:\n    pass\nelse:\n    pass\n", 2),
        ("a and b and c\n", 2),
        ("a and b or c\n", 2),
        ("[x for x in y]\n", 0),
        ("[x for x in y if x]\n", 1),
        ("x = 1 if a else 2\n", 1),
        ("try:\n    pass\nexcept A:\n    pass\nexcept B:\n    pass\nfinally:\n    pass\n", 2),
        ("match a:\n    case 1:\n        pass\n    case _:\n        pass\n", 2),
        ("with a:\n    assert b\n", 0),
    ],
)
def test_each_kind_of_branch_counts_as_said(source: str, expected: int) -> None:
    assert count(source).branches == expected


def test_blank_lines_comments_and_docstrings_are_no_code_lines() -> None:
    assert code_lines('"""Doc\n\nof three."""\n\n# comment\nX = 1  # why\n"""What X is."""\n') == 1


def test_a_string_that_is_a_value_is_code_but_for_its_blank_lines() -> None:
    assert code_lines('X = """a\n\nb"""\n') == 2


def test_a_module_is_the_sum_of_its_functions_where_all_code_stands_in_them() -> None:
    found = list(functions(EVERY_BRANCH, Path("m.py")))
    assert {each.name: each.branches for each in found} == {"outer": 11, "inner": 1}
    assert count(EVERY_BRANCH).branches == 12


def test_a_folder_without_code_has_no_branches() -> None:
    assert Count().per_100 == 0.0


def test_the_table_names_folder_and_yardstick_and_the_worst_functions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "m.py").write_text(EVERY_BRANCH)
    main([str(tmp_path), "--functions", "1", "--beside", "mcp"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["folder", "lines", "code", "lines", "branches", "per", "100"]
    assert lines[1].split()[0] == str(tmp_path)
    assert lines[1].split()[3] == "12"
    assert lines[2].split()[0] == "mcp"
    assert lines[3].split() == ["11", f"{tmp_path / 'm.py'}:5", "outer"]


def test_a_function_is_named_once_where_folders_overlap(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "m.py").write_text(EVERY_BRANCH)
    main([str(tmp_path), str(tmp_path / "m.py"), "--functions", "9"])
    assert capsys.readouterr().out.count("  outer\n") == 1


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit):
        main([str(tmp_path / "nothing")])


def test_a_package_that_is_not_installed_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="not an installed package"):
        main([str(tmp_path), "--beside", "no_such_package_here"])
