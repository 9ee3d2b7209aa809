"""A blank tab with those scripts of the page that need no picture: tests call them with numbers."""

from brushgs.outlets.page.html import script_beginning, web_text

SCRIPTS = ("container.js", "matrix.js", "camera.js", "orbit.js", "pick.js", "controls.js")
SCRIPTS += ("camera_file.js", "pace.js")
HOOK = """
window.kit = { PageCamera, Orbit, Controls, Pace, pointOnRay, cameraFile, commandLine, shellQuoted };
window.kit.facts = (camera) => ({ ...camera, viewmat: [...camera.viewmat] });
"""


def kit(open_page):
    """A tab in which `kit` has the classes and functions of these scripts."""
    page = open_page("about:blank")
    parts = [script_beginning(), *map(web_text, SCRIPTS), HOOK]
    page.evaluate('(() => {\n"use strict";\n' + "\n".join(parts) + "\n})();")
    return page
