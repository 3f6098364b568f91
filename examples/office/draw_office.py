#!/usr/bin/env python3
"""Draws the office: office.png beside this file, as office.yaml describes it."""

import os
import struct
import zlib

WIDTH, HEIGHT, RESOLUTION = 24.0, 14.0, 0.05
WALL = 0.1
CORRIDOR = (5.8, 8.2)
SIDE_WALLS = (6.0, 12.0, 18.0)
DOOR = 1.4
# Middles of the doors along x, on both sides of the corridor.
DOORS_NORTH = (2.5, 9.0, 14.0, 21.0)
DOORS_SOUTH = (4.0, 10.0, 16.5, 20.5)
# Desks, shelves and tables: least x, least y, greatest x, greatest y.
FURNITURE = (
    (0.1, 13.0, 2.0, 13.9), (4.6, 12.2, 5.9, 13.0), (6.1, 12.8, 7.0, 13.9), (10.6, 13.1, 11.9, 13.9),
    (12.1, 10.2, 12.9, 12.0), (16.2, 12.9, 17.9, 13.9), (20.3, 10.6, 21.9, 11.5), (22.8, 13.0, 23.9, 13.9),
    (0.1, 0.1, 1.2, 2.0), (4.9, 0.1, 5.9, 1.1), (8.2, 2.0, 10.2, 3.2), (12.1, 0.1, 13.4, 0.9),
    (17.0, 0.1, 17.9, 1.6), (18.1, 0.1, 18.7, 2.6), (12.1, 4.9, 12.5, 5.8),
)


def main():
    columns, rows = round(WIDTH / RESOLUTION), round(HEIGHT / RESOLUTION)
    cells = [[254] * columns for _ in range(rows)]

    def fill(rectangle, value):
        west, south, east, north = (round(edge / RESOLUTION) for edge in rectangle)
        for row in range(max(south, 0), min(north, rows)):
            for column in range(max(west, 0), min(east, columns)):
                cells[row][column] = value

    for wall in ((0, 0, WIDTH, WALL), (0, HEIGHT - WALL, WIDTH, HEIGHT), (0, 0, WALL, HEIGHT),
                 (WIDTH - WALL, 0, WIDTH, HEIGHT)):
        fill(wall, 0)
    for y, doors in zip(CORRIDOR, (DOORS_SOUTH, DOORS_NORTH)):
        fill((0, y - WALL / 2, WIDTH, y + WALL / 2), 0)
        for door in doors:
            fill((door - DOOR / 2, y - WALL / 2, door + DOOR / 2, y + WALL / 2), 254)
    for x in SIDE_WALLS:
        fill((x - WALL / 2, 0, x + WALL / 2, CORRIDOR[0]), 0)
        fill((x - WALL / 2, CORRIDOR[1], x + WALL / 2, HEIGHT), 0)
    for rectangle in FURNITURE:
        fill(rectangle, 0)

    # The first row of an image is the north.
    raw = b"".join(b"\0" + bytes(row) for row in reversed(cells))
    header = struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(raw, 9)), (b"IEND", b""))
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "office.png"), "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for name, data in chunks:
            check = struct.pack(">I", zlib.crc32(name + data))
            file.write(struct.pack(">I", len(data)) + name + data + check)


if __name__ == "__main__":
    main()
