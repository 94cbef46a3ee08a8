"""Pages agree with one another and link to what is there."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "host/docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md")])


def anchors(page):
    """GitHub's anchors of a page's headings."""
    heads = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", h).lower()).strip().replace(" ", "-") for h in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_each_link_leads_to_a_page_and_a_heading_that_are_there(page):
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"https?:|mailto:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), f"{page.name}: {target}"
        if anchor and file.suffix == ".md":
            assert anchor in anchors(file), f"{page.name}: {target}; has {sorted(anchors(file))}"


def test_tables_of_the_readme_are_those_of_the_results():
    text = (ROOT / "README.md").read_text("utf-8")
    in_readme = rows(text[text.index("## What it reaches"):text.index("## Use\n")])
    there = rows((DOCS / "results.md").read_text("utf-8"))
    assert len(in_readme) > 8 and in_readme <= there, in_readme - there


def test_figures_of_the_first_table_of_the_readme_are_those_of_the_results():
    """Each figure of its two columns against the row of results.md, or of gap-crazypad.md, that it is from."""
    text, there = (path.read_text("utf-8") for path in (ROOT / "README.md", DOCS / "results.md"))
    edges, simulated, trained, named = (cells[1:3] for cells in tables(text[:text.index("(*) Not a blind")])[2:])

    def cells_of(section, first):
        return next(cells for cells in tables(there[there.index(f"\n{section}\n"):]) if cells[0] == first)

    def numbers(*texts):
        return [re.search(r"[\d.]+", text).group() for text in texts]

    _, missed, _, error, *_ = cells_of("## Edges", "`best`")
    assert edges[0].startswith("{} % of 174 edges missed, the others {} m off".format(*numbers(missed, error)))
    high, others = (cells_of("### Where `best` fails", "0201")[i] for i in (2, 3))
    missed_high, high_edges = map(int, re.match(r"(\d+) of (\d+)", high).groups())
    other_edges = re.match(r"none of (\d+)", others)
    all_edges = high_edges + int(other_edges.group(1))
    assert edges[1].startswith(f"{missed_high} of {all_edges} missed on one of their days, held out whole: "
                               f"all {missed_high} are among its {high_edges} edges")
    for said, name in zip(simulated, ("`paper-4cm`", "`paper-mixed`"), strict=True):
        seeds = cells_of("## Flights of the virtual drone", name)[2:]
        assert said.startswith(name), said
        assert ": {} % and {} % of 40 edges missed (two seeds)".format(*numbers(*seeds)) in said
    detector = "## A detector from the simulator"
    small, large = (cells_of(detector, name) for name in ("the twin and the free air of the other half (two trainings)",
                                                          "the same"))
    assert trained[0].startswith("edges {} m off, {} % missed in 34 flights;".format(*numbers(*small[2:4]))), small
    assert "34 flights" in small[1] and "53 flights" in large[1]
    assert trained[1].startswith("edges {} m off, {} % missed in the 53 others;".format(*numbers(*large[2:4]))), large
    ground = cells_of("## Gaps", "the same, **day 21** (*)")[1].split(", ")
    assert any(part.startswith(named[0].split(" ground")[0]) for part in ground)
    crazypad = cells_of("## Gaps", "CrazyPAD, real defects, no gyro")[1]
    rotors = re.search(r"the exact rotors in (\d+) %", crazypad).group(1)
    assert named[1].startswith(f"the damaged rotors of {rotors} % of 72 recorded flights")
    page = (DOCS / "gap-crazypad.md").read_text("utf-8")
    exact = next(cells for cells in tables(page) if cells[0] == "the same of all 72 flights")
    assert exact[2].startswith(f"0.{rotors} ")


def test_sealed_figures_of_the_results_are_of_the_seed_of_their_command():
    """Rows of results.md against that seed's column of gap-blind.md."""
    there = (DOCS / "results.md").read_text("utf-8")
    seed = re.search(r"^\| sealed set with the relations .*--seed (\d+)`", there, re.M).group(1)
    head, _, *measured = tables((DOCS / "gap-blind.md").read_text("utf-8").split("## Goals, and")[1].split("\n## ")[0])
    column = head.index(f"seed {seed}")
    value = {row[0]: (row[column], row[column + 1]) for row in measured}
    reached = dict(tables(there.split("\n## Gaps\n")[1].split("\n(*)")[0]))
    right, alarms = reached["own sealed set, with the [relations of signals](gap-relations.md)"].split("; ")
    figure, n = value["first answer right, single effects"]
    assert figure in right and right.endswith(f" of {n}") and f"in {figure.split(' [')[0]} of sim" in there[:1000]
    figure, n = value["false alarms"]
    count, low_high = re.match(r"(\d+) false alarms in \d+ \[(.*) %\]", alarms).groups()
    assert figure.split(" %")[0] == f"{100 * int(count) / int(n):.1f}" and low_high in figure
    figure, n = value["effect left out, all flights: AUROC; a wrong name"]
    assert reached["the same: effects that the registry lacks"] == f"a wrong name for {figure.split('; ')[1]} of {n}"
    weak, pair = (" of ".join(value[name]) for name in (
        "at the weakest strength", "both effects of a pair, and nothing else"))
    assert reached["the same: the weakest strengths; both effects of a pair"] == f"{weak}; {pair}"


def tables(text):
    """The cells of each row of a page's tables."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]


def rows(text):
    """The rows of a page's tables, links as from host/docs."""
    return {re.sub(r"\((?:host/docs/)?", "(", line) for line in text.splitlines() if line.startswith("|")}


def test_figures_of_recorded_flights_are_the_sums_of_their_tables():
    """Goals of gap-real.md and rows of results.md against the tables flight by flight."""
    page = (DOCS / "gap-real.md").read_text("utf-8")

    def table(start):
        return re.search(r"^\| flights \|.*\n\|[-|]+\n((?:\|.*\n)+)", page[page.index(start):], re.M).group(1)

    view, build, nominal, unknown_scatter = map(table, (
        "**Flights to which no constant", "were built on.", "**Every nominal flight",
        "**The same in flights whose scatter"))

    def total(rows, truth):
        counts = [re.search(r"(\d+) of (\d+)", line).groups() for line in rows.splitlines()
                  if f"| {truth} |" in line and line.startswith("| neural") and "--partner" not in line]
        return " of ".join(str(sum(map(int, column))) for column in zip(*counts, strict=True))

    def whole(rows):
        counts = [re.search(r"(\d+) of (\d+)", line).groups() for line in rows.splitlines()]
        return " of ".join(str(sum(map(int, column))) for column in zip(*counts, strict=True))

    results = (DOCS / "results.md").read_text("utf-8")
    goals = page[page.index("## Goals"):page.index("## Flight by flight")].splitlines()
    for truth, sign in (("none", "same, rule flights"), ("ground effect", "effect named"),
                        ("downwash", "downwash named, no")):
        goal_lines = "".join(line for line in goals if sign in line)
        assert total(view, truth) in goal_lines and total(view, truth) in results, truth
        assert total(build, truth) in results and (truth == "none" or total(build, truth) in goal_lines), truth
    first, below = page[:page.index("- **Trust it**")], page[page.index("## Goals"):]
    best_and_worst = re.findall(r"\d+ of \d+", first[first.index("| best |"):])
    assert len(best_and_worst) >= 6 and all(f" {figure}" in below for figure in best_and_worst), best_and_worst
    for rows_of_part in (nominal, unknown_scatter):
        assert whole(rows_of_part) in page[:page.index("## Flight by flight")] and whole(rows_of_part) in results


def test_every_page_can_be_reached_from_the_readme():
    linked = set(re.findall(r"\(host/docs/([\w-]+\.md)", (ROOT / "README.md").read_text("utf-8")))
    reached, todo = set(), list(linked)
    while todo:
        name = todo.pop()
        if name not in reached and (DOCS / name).exists():
            reached.add(name)
            todo += re.findall(r"\(([\w-]+\.md)", (DOCS / name).read_text("utf-8"))
    assert {p.name for p in DOCS.glob("*.md")} <= reached, {p.name for p in DOCS.glob("*.md")} - reached


def test_the_first_page_and_the_site_list_every_page_in_the_same_order():
    listed = re.findall(r"\]\(([\w-]+\.md)\)", (DOCS / "index.md").read_text("utf-8"))
    site = (ROOT / "host/mkdocs.yml").read_text("utf-8")
    assert ["index.md", *listed] == re.findall(r"- ([\w-]+\.md)", site[site.index("nav:"):])
    assert sorted(["index.md", *listed]) == sorted(p.name for p in DOCS.glob("*.md"))


def prose(page):
    """The lines of a page outside blocks and tables."""
    text = re.sub(r"^ *```.*?^ *```", "", page.read_text("utf-8"), flags=re.S | re.M)
    return [line for line in text.splitlines() if not line.startswith("|")]


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted(DOCS.glob("*.md"))], ids=lambda p: p.name)
def test_lines_are_no_longer_than_they_may(page):
    assert [line for line in prose(page) if len(line) > 120] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_item_of_a_list_begins_at_the_end_of_a_line(page):
    """As in `its table. 3.`; a sentence may end in a figure."""
    assert [line for line in prose(page) if re.search(r"[.:;] \d+\.$", line)] == []


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.name)
def test_tables_and_lists_stand_apart_for_the_site(page):
    """Python-Markdown joins a table or a list to the lines right above it, where GitHub does not."""
    lines = re.sub(r"^```.*?^```", "```", page.read_text("utf-8"), flags=re.S | re.M).splitlines()
    for above, line in pairwise(lines):
        if above.strip() and not above.startswith(("#", "<!--")):
            assert not line.startswith("|") or above.startswith("|"), line
            assert not re.match(r"(- |1\. )", line) or re.match(r"(- |\d+\. |  )", above), line


def test_a_long_page_begins_with_links_to_its_sections():
    """In the first 60 lines, four or more; the ledger is read from its end."""
    for page in DOCS.glob("*.md"):
        lines = page.read_text("utf-8").splitlines()
        if len(lines) > 250 and page.name not in ("looks.md", "api.md"):
            links = set(re.findall(r"\]\(#([\w-]+)\)", "\n".join(lines[:60])))
            assert len(links) >= 4, (page.name, links)


#: pages that tell a newcomer which files to open
MAPS = ("architecture", "add-an-effect", "change-the-network", "unknown", "port")


@pytest.mark.parametrize("name", MAPS)
def test_files_and_names_that_a_page_sends_to_are_there(name):
    text = (DOCS / f"{name}.md").read_text("utf-8")
    paths = re.findall(r"`((?:[\w-]+/)+[\w.-]*)`", text)
    assert len(paths) >= 3
    for path in paths:
        assert any((root / path).exists() for root in (ROOT, ROOT / "host/airtouch")), path
    for path, names in re.findall(r"`((?:[\w-]+/)+\w+\.py)`(?: \||:) ((?:`\w+`(?:, )?)+)", text):
        file = next(root / path for root in (ROOT, ROOT / "host/airtouch") if (root / path).exists())
        source = file.read_text("utf-8")
        for symbol in re.findall(r"`(\w+)`", names):
            assert re.search(rf"^(def |class |)?{symbol}\b|^[A-Z_, ]*\b{symbol}\b.* = ", source, re.M), (path, symbol)


#: sections of the paper that hold an algorithm, an implementation or an experiment
SECTIONS = ("2.1", "2.2", "3", "4.1", "4.2", "4.3", "5.1", "5.2", "5.3", "6", "7.1", "7.2", "7.3", "7.4", "7.5", "7.6",
            "7.7", "7.8", "8.1", "8.2", "8.3")


def test_every_section_of_the_paper_has_a_row_and_every_path_of_it_is_there():
    text = (DOCS / "architecture.md").read_text("utf-8")
    table = text.split("## Where each section of the paper stands")[1].split("\n## ")[0]
    rows = [line for line in table.splitlines() if line.startswith("| ")][1:]
    numbers = re.findall(r"\b\d(?:\.\d)?\b", " ".join(row.split("|")[1] for row in rows))
    assert [section for section in SECTIONS if section not in numbers] == []
    for path in re.findall(r"`((?:[\w-]+/)+[\w.-]+)`", table.split("|", 1)[1]):
        root = ROOT if path.startswith(("firmware/", "gap8/", "tools/")) else ROOT / "host/airtouch"
        assert (root / path).is_file(), path


def test_every_file_of_the_diagnosis_is_named_by_a_decision():
    text = (DOCS / "architecture.md").read_text("utf-8")
    room = ROOT / "host/airtouch/gap"
    modules = [path.relative_to(room).as_posix() for path in room.rglob("*.py") if path.name != "__init__.py"]
    assert len(modules) > 40 and [name for name in modules if f"`gap/{name}`" not in text] == []


@pytest.mark.parametrize("name", MAPS[1:])
def test_a_task_has_at_most_five_files_to_open_and_shows_a_command(name):
    text = (DOCS / f"{name}.md").read_text("utf-8")
    assert text.splitlines()[1].startswith("After this page ")
    rows = re.search(r"^\| file \| .*\n\|[-|]*\n((?:\|.*\n)+)", text, re.M)
    assert rows and 1 <= len(rows.group(1).splitlines()) <= 5
    assert text.count("```") >= 4  # a command and what it prints
