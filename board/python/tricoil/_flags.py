"""Flags of a pose."""

import enum

from . import _tricoil


class Flag(enum.IntFlag):
    """Reasons why a pose is invalid or doubtful. DISTORTED, COASTING, COLUMNS_MISSING and ROLL_UNDEFINED are warnings; the others make it invalid."""

    SATURATED = 1 << 0  # a channel reached full scale or clipped
    LOW_SIGNAL = 1 << 1  # signal-to-noise ratio below the limit
    NO_SENSOR = 1 << 2  # no dipole fits the couplings
    DISTORTED = 1 << 3  # couplings differ from a dipole's as near metal
    WRONG_HANDEDNESS = 1 << 4  # a coil is reversed, or two are swapped
    STALE = 1 << 5  # no usable measurement for some time
    NOT_CONVERGED = 1 << 6  # the solver did not converge
    HEMISPHERE_UNKNOWN = 1 << 7  # the sign of the position is a guess
    NO_REFERENCE = 1 << 8  # no source current
    UNCONFIRMED = 1 << 9  # the newest measurements contradict the prediction, or too few agree yet
    INCONSISTENT = 1 << 10  # the last measurements differ more than their noise allows
    COASTING = 1 << 11  # no new measurement; the pose is predicted
    UNCERTAIN = 1 << 12  # the standard deviation of the position is above its limit
    COLUMNS_MISSING = 1 << 13  # some of the last measurements were lost or refused
    ROLL_UNDEFINED = 1 << 14  # sensor of one coil: the rotation about its axis, x of its frame, is arbitrary

    def __str__(self) -> str:
        """Names in lower case, separated by commas, as in messages of the program; empty if no flag is set."""
        return ", ".join(flag.name.lower() for flag in type(self) if flag in self)


#: Flags that make a pose invalid.
INVALIDATING = Flag(_tricoil.INVALIDATING_FLAGS)
