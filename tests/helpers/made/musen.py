"""MUSEN's export as text, at two times."""

STATE = "2 {time} 12 {x} 0.5 0.5 15 9 9 9 16 9 9 9 18 0 20 9 9 9 31 1 0 0 0 36 9 9 9 9 9 9 9 9 9"


def sphere(id, x, radius=0.1, active="0 1e+300"):
    """Its contact radius is another number; it moves by 0.01 between both times."""
    states = " ".join(STATE.format(time=time, x=x + time / 50) for time in (0, 0.5))
    return f"0 {id} 1 1 5 {radius} 0.4 23 KEY 24 {active} {states}\n"


def export(*rows, domain="28 0 0 0 0 0 0 0 0 0 0"):
    bond = "0 7 1 9 5 3 1 0.1 0.2 23 KEY 24 0 1e+300 2 0 12 0 0 0 15 0 0 0 18 0 20 0 0 0\n"
    return "".join(rows) + bond + f"22 0 0 0 1 1 1\n{domain}\n29 0\n32 KEY Glass 0 2500\n\n"


ROWS = (sphere(3, 0.2), sphere(1, 0.375), sphere(2, 0.6, active="0.25 0.5"))
