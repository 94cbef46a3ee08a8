"""A report's page as a browser would take it: its text, its open tags, and what it loads."""

import html.parser


class PageReader(html.parser.HTMLParser):
    """Collects open tags, text and everything that is loaded; asserts that tags close in their order."""

    def __init__(self):
        super().__init__()
        self.open, self.loaded, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)
        self.loaded += [value for key, value in attrs if key in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
