#!/usr/bin/env python3
"""Draws docs/pictures/house.svg from the table of docs/source-layout.md: rooms by floors, and the arrows that no other
way implies. Standard library only. `house.py --check` says whether the picture is that of the table."""
import pathlib
import sys

root = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(root / "tests/house"))
import rooms as house  # noqa: E402

INK, ANALYSIS, OTHER, ARROW = "#222222", "#cfe3f2", "#eeeeee", "#7f7f7f"
WIDTH, HEIGHT, GAP, RISE = 104, 34, 22, 92  # [px] of a room, between rooms, from floor to floor


def direct(rooms):
    """(from, to) of the arrows that no way over other rooms implies."""
    return [(a, b) for a in rooms for b in rooms[a] if not any(b in house.below(c, rooms) for c in rooms[a] if c != b)]


def ways(rooms, arrows):
    """[[room, ... room]] of each arrow; in between it passes through a gap of each floor, (from, to, floor)."""
    floor = house.floors(rooms)
    return [[a] + [(a, b, f) for f in range(floor[a] - 1, floor[b], -1)] + [b] for a, b in arrows]


def places(rooms, all_ways):
    """{room or gap: (x, y) of its middle}; each floor in the order that keeps arrows short."""
    floor = house.floors(rooms)
    storeys = [[r for r in rooms if floor[r] == f] for f in range(max(floor.values()) + 1)]
    near = {r: [] for r in rooms}
    for way in all_ways:
        for gap in way[1:-1]:
            storeys[gap[2]].append(gap)
            near[gap] = []
        for a, b in zip(way, way[1:]):
            near[a].append(b)
            near[b].append(a)
    wide = {x: WIDTH if isinstance(x, str) else 0 for x in near}
    whole = max(sum(wide[x] + GAP for x in s) for s in storeys)
    middle = {}

    def place(f):
        x = (whole - sum(wide[n] + GAP for n in storeys[f])) / 2
        for node in storeys[f]:
            middle[node] = (x + (wide[node] + GAP) / 2, (len(storeys) - 1 - f) * RISE + HEIGHT)
            x += wide[node] + GAP

    for f in range(len(storeys)):
        place(f)
    for _ in range(20):  # each comes to stand over the mean of what it leads to, and of what leads to it
        for f in range(len(storeys)):
            storeys[f].sort(key=lambda n: sum(middle[o][0] for o in near[n]) / len(near[n]))
            place(f)
    return middle


def path_of(way, middle):
    """Down from room to room, straight through the gaps."""
    x, y = middle[way[0]]
    y += HEIGHT / 2
    path = f"M{x:.0f} {y:.0f}"
    for node in way[1:]:
        to, below = middle[node]
        below -= HEIGHT / 2
        path += f"C{x:.0f} {y + 35:.0f} {to:.0f} {below - 35:.0f} {to:.0f} {below:.0f}"
        x, y = to, below
        if node != way[-1]:
            y += HEIGHT
            path += f"V{y:.0f}"
    return path


def drawn(rooms):
    all_ways = ways(rooms, direct(rooms))
    middle = places(rooms, all_ways)
    width = max(x for x, _ in middle.values()) + WIDTH / 2 + GAP
    height = max(y for _, y in middle.values()) + HEIGHT
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
           f'font-family="sans-serif" font-size="13" fill="{INK}">',
           '<title>The rooms of emtb: each may include headers of those that its arrows lead down to</title>',
           f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>',
           '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
           f'<path d="M0 0L8 4L0 8z" fill="{ARROW}"/></marker></defs>']
    svg += [f'<path d="{path_of(way, middle)}" fill="none" stroke="{ARROW}" marker-end="url(#head)"/>'
            for way in all_ways]
    for room in rooms:
        x, y = middle[room]
        name = room.removeprefix("analysis/")
        svg.append(f'<rect x="{x - WIDTH / 2:.0f}" y="{y - HEIGHT / 2:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="4" '
                   f'fill="{OTHER if name == room else ANALYSIS}" stroke="{INK}"/>'
                   f'<text x="{x:.0f}" y="{y + 4:.0f}" text-anchor="middle">{name}</text>')
    return "\n".join(svg + ["</svg>", ""])


if __name__ == "__main__":
    picture, path = drawn(house.table()), root / "docs/pictures/house.svg"
    if "--check" not in sys.argv:
        path.write_text(picture)
    elif not path.exists() or path.read_text() != picture:
        sys.exit("docs/pictures/house.svg is not that of the table in docs/source-layout.md: run docs/pictures/house.py")
