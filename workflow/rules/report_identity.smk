# The exhibits of a run that identifies speakers, and the page that shows them.

MET = ["populations"] if OTHERS["number"] else []
EXHIBITS = declared.of_run(MET, declared.IDENTITY)
EXHIBIT_SOURCES = {
    name: [f"{RESULTS}/{path}" for path in paths] for name, paths in declared.sources(EXHIBITS, {}).items()
}


rule identity_exhibits:
    input:
        sources=[path for paths in EXHIBIT_SOURCES.values() for path in paths],
        published=PUBLISHED,
    output:
        *exhibit_files(EXHIBITS),
    params:
        **WITHOUT_SYSTEMS,
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
        **WITHOUT_SYSTEMS,
        config=config,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
        sources=PAGE_SOURCES,
        absent=declared.absent(MET, declared.IDENTITY, declared.IDENTITY_CONDITIONS),
    message:
        "the page"
    script:
        "../../scripts/report/identity_page.py"
