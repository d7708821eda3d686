"""The time per rule, from benchmark files as Snakemake writes them."""

import csv

from project import ROOT

from cospeech.report import timings

HEAD = "s\th:m:s\tmax_rss\tcpu_time\n"


def benchmarks(folder):
    for name, s, rss in [("page", 2.0, "300.5"), ("hsmm/ada_1", 5.0, "NA"), ("hsmm/ada_2", 3.0, "250")]:
        path = folder / f"{name}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{HEAD}{s}\t0:00:0{s:.0f}\t{rss}\tNA\n")
    return folder


def test_the_jobs_of_a_rule_share_a_row_the_longest_rule_first(tmp_path):
    assert timings.rows(benchmarks(tmp_path)) == [
        ("hsmm", 2, 8.0, 4.0, 250.0, 80.0),
        ("page", 1, 2.0, 2.0, 300.5, 20.0),
    ]


def test_page_and_table_say_the_same(tmp_path):
    template = ROOT / "reports/template/seconds.html.jinja"
    timings.save(benchmarks(tmp_path / "benchmarks"), tmp_path / "reports", template, "<a run>")
    table = list(csv.DictReader((tmp_path / "reports/tables/table-seconds.csv").read_text().splitlines()))
    page = (tmp_path / "reports/seconds.html").read_text()
    assert [row["rule"] for row in table] == ["hsmm", "page"]
    assert "<td>hsmm</td><td>2</td><td>8.0</td><td>4.00</td><td>250</td><td>80.0</td>" in page
    assert "&lt;a run&gt;" in page
