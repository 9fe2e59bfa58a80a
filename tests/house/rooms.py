"""The rooms of the house and what each may include, as the table of docs/source-layout.md says."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]


def rooms_of(page):
    """{room: [rooms whose headers it may include]} of a page with the table."""
    rooms = {}
    for line in page.splitlines():
        row = re.fullmatch(r"\| `([\w/]+)/` \|(.*)\|(.*)\|", line.strip())
        if row:
            rooms[row[1]] = re.findall(r"`([\w/]+)`", row[3])
    return rooms


def table(root=ROOT):
    return rooms_of((root / "docs/source-layout.md").read_text())


def room_of(path, rooms):
    """The room that a path from the root lies in, or None."""
    return next((room for room in rooms if path.startswith(room + "/")), None)


def below(room, rooms):
    """All rooms that can be reached from a room by the allowed arrows."""
    seen, ahead = set(), list(rooms[room])
    while ahead:
        other = ahead.pop()
        if other not in seen:
            seen.add(other)
            ahead += rooms.get(other, [])
    return seen


def floors(rooms):
    """{room: floor}, the lowest 0; each room stands above all that it may include. Rooms in a circle have none."""
    floor = {}
    while True:
        ready = {r: 1 + max((floor[o] for o in rooms[r]), default=-1)
                 for r in rooms if r not in floor and all(o in floor for o in rooms[r])}
        if not ready:
            return floor
        floor.update(ready)
