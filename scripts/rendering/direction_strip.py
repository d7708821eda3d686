"""Draw the stick figure and the body that give route directions."""

from cospeech.formats import canvas
from cospeech.rendering import directions
from cospeech.workflow import job

with job.run(snakemake) as work:
    animation = work.read(work.input.animation, "direction_animation")
    caption = f"{animation['record'].iloc[0]} · {work.corpus}"
    canvas.save(directions.strip(animation, caption), work.output.strip)
