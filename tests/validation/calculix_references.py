#!/usr/bin/env python3
"""Computes the reference solutions of `fulcrum validate` with CalculiX and writes them to a file.

    calculix_references.py [--out FILE] [CASE...]

Needs `ccx` (Debian: calculix-ccx). The cases are solids of quadratic bricks (C3D20R) with the neo-Hookean law of
CalculiX, mu/2 (I1 J^(-2/3) - 3) + K/2 (J - 1)^2, and loads that keep their direction. Each case is solved on two
meshes; the file has the value on the finer one and its relative change from the coarser one.
"""
import argparse
import math
import pathlib
import re
import subprocess
import sys
import tempfile

YOUNGS_PA, POISSON, DENSITY_KG_M3 = 1.0e5, 0.45, 1000.0
SHEAR_PA = YOUNGS_PA / (2 * (1 + POISSON))
BULK_PA = YOUNGS_PA / (3 * (1 - 2 * POISSON))

# Corner and edge nodes of a brick in CalculiX's order, on a grid of half bricks.
BRICK = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
         (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
         (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
GAUSS = [(-math.sqrt(0.6), 5 / 9), (0.0, 8 / 9), (math.sqrt(0.6), 5 / 9)]
# Nodes of a face with eight nodes, in its own coordinates.
FACE = [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)]


def face_shapes(a, b):
    """Shape functions of a face with eight nodes, and their derivatives by a and by b."""
    shapes, by_a, by_b = [], [], []
    for p, q in FACE:
        if p and q:
            shapes.append((1 + p * a) * (1 + q * b) * (p * a + q * b - 1) / 4)
            by_a.append(p * (1 + q * b) * (2 * p * a + q * b) / 4)
            by_b.append(q * (1 + p * a) * (p * a + 2 * q * b) / 4)
        elif p:
            shapes.append((1 + p * a) * (1 - b * b) / 2)
            by_a.append(p * (1 - b * b) / 2)
            by_b.append(-b * (1 + p * a))
        else:
            shapes.append((1 - a * a) * (1 + q * b) / 2)
            by_a.append(-a * (1 + q * b))
            by_b.append(q * (1 - a * a) / 2)
    return shapes, by_a, by_b


class Mesh:
    """Bricks on a grid of nx x ny x nz, mapped by `place`, a function of half steps."""

    def __init__(self, counts, place):
        self.counts, self.place, self.number = counts, place, {}
        self.bricks = []
        for i in range(counts[0]):
            for j in range(counts[1]):
                for k in range(counts[2]):
                    self.bricks.append([self._node(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in BRICK])
        self.at = {number: place(*node) for node, number in self.number.items()}

    def _node(self, *node):
        return self.number.setdefault(node, len(self.number) + 1)

    def where(self, condition):
        return sorted(number for node, number in self.number.items() if condition(*node))

    def load_on_top(self, traction):
        """Nodal forces of a traction (a function of the place) on the faces where the third index is greatest."""
        forces, top = {}, 2 * self.counts[2]
        for i in range(self.counts[0]):
            for j in range(self.counts[1]):
                nodes = [self.number[(2 * i + 1 + p, 2 * j + 1 + q, top)] for p, q in FACE]
                for a, weight_a in GAUSS:
                    for b, weight_b in GAUSS:
                        shapes, by_a, by_b = face_shapes(a, b)
                        along = [[sum(d * self.at[n][x] for d, n in zip(by, nodes)) for x in range(3)]
                                 for by in (by_a, by_b)]
                        here = [sum(s * self.at[n][x] for s, n in zip(shapes, nodes)) for x in range(3)]
                        u, v = along
                        area = math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                          u[0] * v[1] - u[1] * v[0])
                        force = traction(*here)
                        for s, n in zip(shapes, nodes):
                            total = forces.setdefault(n, [0.0, 0.0, 0.0])
                            for x in range(3):
                                total[x] += s * area * weight_a * weight_b * force[x]
        return forces

    def write(self, path, fixed, forces, step, printed):
        """`fixed`: (nodes, axis) pairs; `printed`: nodes whose displacement is printed."""
        with open(path, "w", encoding="ascii") as out:
            out.write("*NODE, NSET=ALL\n")
            for number, place in sorted(self.at.items()):
                out.write(f"{number}, " + ", ".join(f"{x:.12g}" for x in place) + "\n")
            out.write("*ELEMENT, TYPE=C3D20R, ELSET=SOLID\n")
            for number, nodes in enumerate(self.bricks, 1):
                text = [str(number)] + [str(n) for n in nodes]
                out.write(", ".join(text[:11]) + ",\n" + ", ".join(text[11:]) + "\n")
            out.write("*NSET, NSET=PRINTED\n" + "".join(f"{n},\n" for n in printed))
            out.write("*BOUNDARY\n" + "".join(f"{n}, {axis}, {axis}\n" for nodes, axis in fixed for n in nodes))
            if step == "static":
                out.write(f"*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, NEO HOOKE\n{SHEAR_PA / 2:.12g}, {2 / BULK_PA:.12g}\n")
            else:
                out.write(f"*MATERIAL, NAME=TISSUE\n*ELASTIC\n{YOUNGS_PA}, {POISSON}\n*DENSITY\n{DENSITY_KG_M3}\n")
            out.write("*SOLID SECTION, ELSET=SOLID, MATERIAL=TISSUE\n")
            if step == "static":
                out.write("*STEP, NLGEOM, INC=200\n*STATIC\n0.1, 1.0\n*CLOAD\n")
                for number, force in sorted(forces.items()):
                    out.write("".join(f"{number}, {x + 1}, {force[x]:.12g}\n" for x in range(3) if force[x]))
                out.write("*NODE PRINT, NSET=PRINTED, FREQUENCY=1000\nU\n*END STEP\n")
            else:
                out.write("*STEP\n*FREQUENCY\n8\n*NODE PRINT, NSET=PRINTED\nU\n*END STEP\n")


def run(mesh, fixed, forces, step, printed):
    """Displacements of `printed` by node, or the natural frequencies [Hz]."""
    with tempfile.TemporaryDirectory() as folder:
        mesh.write(pathlib.Path(folder) / "case.inp", fixed, forces, step, printed)
        done = subprocess.run(["ccx", "-i", "case"], cwd=folder, capture_output=True, text=True, check=False)
        lines = (pathlib.Path(folder) / "case.dat").read_text().splitlines()
        if done.returncode or not lines:
            sys.exit("ccx failed:\n" + done.stdout[-2000:])
    if step == "frequency":
        rows = [line.split() for line in lines if re.match(r"\s*\d+\s+[-\d.]+E[-+]\d+\s+[-\d.]+E", line)]
        return [float(row[3]) for row in rows if len(row) == 5][:8]
    begin = max(i for i, line in enumerate(lines) if "displacements" in line)
    moved = {}
    for line in lines[begin + 1:]:
        row = line.split()
        if len(row) == 4:
            moved[int(row[0])] = [float(x) for x in row[1:]]
    return moved


def dent(scale):
    """A quarter of a block of 40 x 40 x 20 mm on a plate to which it sticks, pressed from above."""
    n, size, radius, pressure = 8 * scale, 0.02, 0.01, 1.4e4
    mesh = Mesh((n, n, n), lambda i, j, k: tuple(x * size / (2 * n) for x in (i, j, k)))

    def traction(x, y, _):
        far = (x * x + y * y) / radius**2
        return (0, 0, -pressure * (1 - far)**2 if far < 1 else 0)

    fixed = [(mesh.where(lambda i, j, k: k == 0), axis) for axis in (1, 2, 3)]
    fixed += [(mesh.where(lambda i, j, k: i == 0), 1), (mesh.where(lambda i, j, k: j == 0), 2)]
    centre = mesh.number[(0, 0, 2 * n)]
    return {"dent.depth": (-run(mesh, fixed, mesh.load_on_top(traction), "static", [centre])[centre][2], "m")}


def ring(scale, layers=2):
    """A quarter of a tube of radii 15 and 18 mm: angle from the top, along, outwards."""
    across, thick = 24 * scale, layers * scale

    def place(i, j, k):
        angle, r = math.pi / 2 * i / (2 * across), 0.015 + 0.003 * k / (2 * thick)
        return (r * math.sin(angle), 0.001 * j / 2, r * math.cos(angle))

    return Mesh((across, 1, thick), place)


def pinch(scale):
    """Plane strain: pressed from above and below, by a traction that falls to nothing 30 degrees beside the top."""
    mesh, pressure = ring(scale), 350.0

    def traction(x, _, z):
        angle = math.atan2(x, z)
        return (0, 0, -pressure * math.cos(3 * angle)**2 if angle < math.pi / 6 else 0)

    fixed = [(mesh.where(lambda i, j, k: True), 2)]
    fixed += [(mesh.where(lambda i, j, k: i == 0), 1), (mesh.where(lambda i, j, k: i == 2 * mesh.counts[0]), 3)]
    top = mesh.number[(0, 0, 2 * mesh.counts[2])]
    side = mesh.number[(2 * mesh.counts[0], 0, 2 * mesh.counts[2])]
    moved = run(mesh, fixed, mesh.load_on_top(traction), "static", [top, side])
    return {"pinch.closure": (-2 * moved[top][2], "m"), "pinch.widening": (2 * moved[side][0], "m")}


def beam_mesh(scale):
    """Half of a bar of 80 x 10 x 10 mm, clamped at x = 0; y = 0 is its plane of symmetry."""
    counts = (32 * scale, 2 * scale, 4 * scale)
    return Mesh(counts, lambda i, j, k: (0.08 * i / (2 * counts[0]), 0.005 * j / (2 * counts[1]),
                                         0.01 * k / (2 * counts[2])))


def clamp(mesh):
    fixed = [(mesh.where(lambda i, j, k: i == 0), axis) for axis in (1, 2, 3)]
    return fixed + [(mesh.where(lambda i, j, k: j == 0 and i > 0), 2)]


def bend(scale):
    """A line load on the upper face, so large that the end sinks by half of the length."""
    mesh, pressure = beam_mesh(scale), 170.0
    force = mesh.load_on_top(lambda x, y, z: (0, 0, -pressure * (x / 0.08)**2))
    end = mesh.number[(2 * mesh.counts[0], 0, mesh.counts[2])]
    moved = run(mesh, clamp(mesh), force, "static", [end])[end]
    return {"bend.sinking": (-moved[2], "m"), "bend.approach": (-moved[0], "m")}


def vibrate(scale):
    """Bending of the bar in its plane of symmetry, and the ovalling of the tube in plane strain."""
    mesh = beam_mesh(scale)
    bar = run(mesh, clamp(mesh), {}, "frequency", [1])
    tube = ring(scale)
    fixed = [(tube.where(lambda i, j, k: True), 2)]
    fixed += [(tube.where(lambda i, j, k: i == 0), 1), (tube.where(lambda i, j, k: i == 2 * tube.counts[0]), 3)]
    oval = run(tube, fixed, {}, "frequency", [1])
    return {"vibrate.bar_1": (bar[0], "Hz"), "vibrate.bar_2": (bar[1], "Hz"), "vibrate.tube": (oval[0], "Hz")}


CASES = {"dent": dent, "pinch": pinch, "bend": bend, "vibrate": vibrate}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help="of: " + ", ".join(CASES) + "; default: all")
    parser.add_argument("--out", default=str(pathlib.Path(__file__).resolve().parents[2] / "deploy/validation/calculix.csv"))
    options = parser.parse_args()
    if unknown := set(options.cases) - set(CASES):
        parser.error(f"no case {', '.join(sorted(unknown))}; valid: {', '.join(CASES)}")
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    version = re.search(r"Version ([\d.]+)", said)
    rows = []
    for name in options.cases or CASES:
        print(name, "...", file=sys.stderr, flush=True)
        coarse, fine = CASES[name](1), CASES[name](2)
        for key, (value, unit) in fine.items():
            rows.append(f"{key},{value:.8g},{unit},{abs(coarse[key][0] / value - 1):.2g}")
            print(rows[-1], file=sys.stderr, flush=True)
    with open(options.out, "w", encoding="ascii") as out:
        out.write(f"# CalculiX {version.group(1) if version else '?'}, by calculix_references.py\n")
        out.write("quantity,value,unit,change_from_half_the_resolution\n" + "\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
