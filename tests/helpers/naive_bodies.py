"""A slow, obvious twin of all that is counted by bodies: which lie side by side in space."""

from itertools import combinations_with_replacement, product

import numpy as np

IMAGES = list(product(range(-2, 3), repeat=3))


def nearest(place, shifts, other):
    """The image of a place that is nearest to another place."""
    return min((place + shift for shift in shifts), key=lambda one: np.sum((one - other) ** 2))


class NaiveBodies:
    """
    Spheres with the number of their body, and a cell whose vectors are all periodic, or none.

    Every contact is found by trying all images; whether its two bodies are one, and whether they
    are those of another contact, is told by how far apart the two bodies lie in space.
    """

    def __init__(self, position, radius, number, vectors=None, dimension=3):
        self.position, self.radius = np.asarray(position), np.asarray(radius)
        images = [k for k in IMAGES if dimension == 3 or k[2] == 0]
        shifts = [np.zeros(3)] if vectors is None else [np.array(k) @ vectors for k in images]
        members = {}
        for row, name in enumerate(number):
            members.setdefault(("alone", row) if name < 0 else ("body", name), []).append(row)
        self.members = list(members.values())
        self.body = {row: k for k, rows in enumerate(self.members) for row in rows}
        # from each sphere to the place of its body, whichever image of it the sphere is in
        self.to_place = {}
        for rows in self.members:
            first = self.position[rows[0]]
            near = {row: nearest(self.position[row], shifts, first) for row in rows}
            volume = sum(self.radius[row] ** dimension for row in rows)
            place = sum(self.radius[row] ** dimension * near[row] for row in rows) / volume
            self.to_place |= {row: place - near[row] for row in rows}
        self.contacts, self.neighbours = 0, set()
        for one, two in combinations_with_replacement(range(len(self.radius)), 2):
            for shift in shifts:
                self._meet(one, two, shift)

    def _meet(self, one, two, shift):
        branch = self.position[two] + shift - self.position[one]
        itself = one == two
        # a sphere and its image in front of it are that behind it
        if itself and tuple(np.round(branch, 6)) <= (0.0, 0.0, 0.0):
            return
        if np.linalg.norm(branch) >= self.radius[one] + self.radius[two]:
            return
        apart = branch + self.to_place[two] - self.to_place[one]
        bodies = self.body[one], self.body[two]
        if bodies[0] == bodies[1] and np.linalg.norm(apart) < 1e-9:
            return
        self.contacts += 1
        turned = bodies[0] > bodies[1] or (
            bodies[0] == bodies[1] and tuple(np.round(apart, 6)) < (0.0, 0.0, 0.0)
        )
        apart, bodies = (-apart, bodies[::-1]) if turned else (apart, bodies)
        self.neighbours.add((*bodies, *(np.round(apart, 6) + 0.0).tolist()))

    def numbers(self, walls):
        """Neighbours of each body, contacts with walls among them."""
        found = [sum(walls[row] for row in rows) for rows in self.members]
        for one, two, *_ in self.neighbours:
            found[one] += 1
            found[two] += 1
        return found

    def pairs(self):
        """The two bodies of each neighbourship."""
        return [(one, two) for one, two, *_ in sorted(self.neighbours)]

    def place(self, row):
        """The place of a sphere's body."""
        return self.position[row] + self.to_place[row]
