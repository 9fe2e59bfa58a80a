"""Called by mkdocs: a link of the manual to a file beside docs/ becomes the name of that file, which is no page."""
import posixpath
import re


def on_page_markdown(markdown, page, **_):
    here = posixpath.dirname(page.file.src_uri)

    def named(match):
        target = posixpath.normpath(posixpath.join("docs", here, match[2].split("#")[0]))
        if target.startswith("docs/"):
            return match[0]
        return f"`{target}`" if match[1].strip("`") == target else f"{match[1]} (`{target}`)"

    return re.sub(r"(?<!!)\[([^\]]+)\]\(((?!https?:|#)[^)\s]+)\)", named, markdown)
