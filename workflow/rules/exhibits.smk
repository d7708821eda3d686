# What every route needs to draw its exhibits and to show them on a page.

from cospeech.report import exhibits as declared

# The template belongs to the program, which may be elsewhere than the results.
TEMPLATE = Path(workflow.basedir) / "reports" / "template"
PARTS = [TEMPLATE / "style.css", *sorted(TEMPLATE.rglob("*.jinja"))]
PUBLISHED = TEMPLATE / "published.yaml"
SECTION_TITLES = {section.anchor: section.short for section in declared.SECTIONS}

# What drawing functions and pages may ask about a run without systems, which most exhibits are about.
WITHOUT_SYSTEMS = {
    "systems": {},
    "heads": {},
    "shown_heads": [],
    "actors": {},
    "pictured": [],
    "in_timeline": [],
    "main": {},
}


def exhibit_files(exhibits):
    """The files of some exhibits; the first of each has a caption in Snakemake's own report."""
    files = []
    for exhibit in exhibits:
        first, *others_of_it = [f"{REPORTS}/{path}" for path in exhibit.files]
        caption = f"../../reports/template/captions/{exhibit.name}.rst"
        files += [report(first, caption=caption, category=SECTION_TITLES[exhibit.section]), *others_of_it]
    return files
