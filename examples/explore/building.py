"""Draws the map of a furnished building, `building.png`, with the standard library alone."""

import struct
import zlib

RESOLUTION = 0.05  # m
WIDTH, HEIGHT = 20.0, 15.0  # m
FREE, OCCUPIED = 254, 0

COLUMNS, ROWS = round(WIDTH / RESOLUTION), round(HEIGHT / RESOLUTION)
cells = [[FREE] * COLUMNS for _ in range(ROWS)]


def fill(left, bottom, right, top, shade=OCCUPIED):
    """Fills a rectangle, m; the origin is the left lower corner."""
    for row in range(max(0, round(bottom / RESOLUTION)), min(ROWS, round(top / RESOLUTION))):
        for column in range(max(0, round(left / RESOLUTION)), min(COLUMNS, round(right / RESOLUTION))):
            cells[row][column] = shade


def disc(x, y, radius):
    for row in range(ROWS):
        for column in range(COLUMNS):
            right, up = (column + 0.5) * RESOLUTION - x, (row + 0.5) * RESOLUTION - y
            if right * right + up * up <= radius * radius:
                cells[row][column] = OCCUPIED


# Outer walls.
fill(0, 0, WIDTH, 0.2)
fill(0, HEIGHT - 0.2, WIDTH, HEIGHT)
fill(0, 0, 0.2, HEIGHT)
fill(WIDTH - 0.2, 0, WIDTH, HEIGHT)

# The corridor, 2.2 m wide, and the rooms on both sides.
fill(0, 6.1, WIDTH, 6.2)
fill(0, 8.4, WIDTH, 8.5)
for x in (5.2, 9.6, 15.0):
    fill(x, 8.5, x + 0.1, HEIGHT)
for x in (6.6, 12.8):
    fill(x, 0, x + 0.1, 6.1)

# Doors, 1.3 m wide.
for x in (2.2, 6.6, 11.6, 17.0):
    fill(x, 8.4, x + 1.3, 8.5, FREE)
for x in (3.0, 9.2, 15.6):
    fill(x, 6.1, x + 1.3, 6.2, FREE)
fill(9.6, 12.6, 9.7, 13.9, FREE)
fill(12.8, 1.4, 12.9, 2.7, FREE)

# Offices above: desks, shelves, a round table, pillars.
fill(0.2, 11.6, 1.0, 13.2)
fill(0.2, 14.3, 3.0, 14.8)
fill(3.9, 10.0, 4.7, 11.6)
fill(5.3, 12.4, 6.1, 14.0)
fill(7.4, 14.2, 9.4, 14.8)
fill(8.8, 9.2, 9.6, 10.8)
disc(12.4, 11.7, 0.7)
fill(9.7, 9.2, 10.1, 11.0)
fill(13.4, 14.4, 15.0, 14.8)
fill(14.4, 9.0, 15.0, 10.4)
fill(16.8, 12.0, 18.4, 12.8)
fill(19.2, 9.4, 19.8, 11.4)
fill(15.1, 14.2, 16.4, 14.8)

# A store room, a hall with pillars and a kitchen below.
fill(0.2, 0.2, 0.8, 3.4)
fill(2.0, 1.6, 4.6, 2.2)
fill(2.0, 3.6, 4.6, 4.2)
fill(5.8, 0.2, 6.6, 1.6)
disc(8.4, 1.9, 0.25)
disc(11.0, 1.9, 0.25)
disc(8.4, 4.3, 0.25)
disc(11.0, 4.3, 0.25)
fill(12.2, 4.6, 12.8, 6.1)
fill(14.2, 0.2, 18.0, 0.8)
fill(15.2, 2.6, 17.4, 3.6)
fill(19.1, 3.0, 19.8, 5.4)
fill(13.4, 5.4, 14.4, 6.1)

# The corridor: cupboards and a plant.
fill(5.0, 8.0, 5.9, 8.4)
fill(13.8, 6.2, 14.8, 6.5)
disc(19.2, 6.8, 0.3)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


rows = b"".join(b"\0" + bytes(row) for row in reversed(cells))
header = struct.pack(">IIBBBBB", COLUMNS, ROWS, 8, 0, 0, 0, 0)
with open("building.png", "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))
