"""The three questions of the authors' flights, on a synthetic manifest."""

from tools.diagnosis.recordings import authors

MANIFEST = """file,use,wind,angle_deg,height
low_0101-a.csv,clean,none,0,low
low_0103-b.csv,clean,none,0,low
h80_0103-c.csv,clean,none,0,h80
fan_0103-d.csv,clean,wind,0,low
oblique_0103-e.csv,clean,none,30,low
messy_0103-f.csv,messy,none,0,low
"""


def test_each_question_has_its_flights_and_what_they_are_held_against(tmp_path):
    (tmp_path / "manifest.csv").write_text(MANIFEST)
    letters = {name: tuple("".join(path[-5] for path in group) for group in groups)
               for name, groups in authors.questions(tmp_path).items()}
    assert letters == {"all": ("ab", ""), "close": ("ab", "c"), "wind": ("d", "bc")}


def test_no_more_low_flights_than_a_minute_allows(tmp_path):
    lines = "\n".join(f"low_0101-{i}.csv,clean,none,0,low" for i in range(30))
    (tmp_path / "manifest.csv").write_text(MANIFEST.splitlines()[0] + "\n" + lines)
    assert len(authors.questions(tmp_path)["close"][0]) == authors.CLOSE
