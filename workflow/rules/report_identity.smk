# The exhibits of a run that identifies speakers, and the page that shows them.

from cospeech.report import exhibits as declared

TEMPLATE = Path(workflow.basedir) / "reports" / "template"
PARTS = [TEMPLATE / "style.css", *sorted(TEMPLATE.rglob("*.jinja"))]
PUBLISHED = TEMPLATE / "published.yaml"
MET = ["populations"] if OTHERS["number"] else []
EXHIBITS = declared.of_run(MET, declared.IDENTITY)
SECTION_TITLES = {section.anchor: section.short for section in declared.SECTIONS}
EXHIBIT_SOURCES = {
    name: [f"{RESULTS}/{path}" for path in paths] for name, paths in declared.sources(EXHIBITS, {}).items()
}

# There are no systems, which every other exhibit is about.
ABOUT_RUN = {
    "systems": {},
    "heads": {},
    "shown_heads": [],
    "actors": {},
    "pictured": [],
    "in_timeline": [],
    "main": {},
}


def exhibit_files():
    """The files of all exhibits; the first of each has a caption in Snakemake's own report."""
    files = []
    for exhibit in EXHIBITS:
        first, *others_of_it = [f"{REPORTS}/{path}" for path in exhibit.files]
        caption = f"../../reports/template/captions/{exhibit.name}.rst"
        files += [report(first, caption=caption, category=SECTION_TITLES[exhibit.section]), *others_of_it]
    return files


rule identity_exhibits:
    input:
        sources=[path for paths in EXHIBIT_SOURCES.values() for path in paths],
        published=PUBLISHED,
    output:
        *exhibit_files(),
    params:
        **ABOUT_RUN,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        sources=EXHIBIT_SOURCES,
        settings={},
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
    message:
        f"{len(EXHIBITS)} exhibits"
    script:
        "../../scripts/report/exhibits.py"


PAGE_SOURCES = {
    name: [f"{RESULTS}/identity/{name}.parquet"]
    for name in ["clips", "delay", "equal_error_rates", *(["gains"] if OTHERS["number"] else [])]
}
PROMISED = [f"{REPORTS}/index.html", *(f"{REPORTS}/{path}" for exhibit in EXHIBITS for path in exhibit.files)]


rule identity_page:
    input:
        sources=[path for paths in PAGE_SOURCES.values() for path in paths],
        template=TEMPLATE / "page.html.jinja",
        parts=PARTS,
        published=PUBLISHED,
        captions=[TEMPLATE / "captions" / f"{exhibit.name}.rst" for exhibit in EXHIBITS],
        exhibits=PROMISED[1:],
    output:
        page=PROMISED[0],
    params:
        **ABOUT_RUN,
        config=config,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
        sources=PAGE_SOURCES,
        absent=declared.absent(MET, declared.IDENTITY, declared.IDENTITY_CONDITIONS),
    message:
        "the page"
    script:
        "../../scripts/report/identity_page.py"
