"""Tracks: layers of beams, node by node along the line."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from tbatch.physics.blocks import BlockTridiagonal
from tbatch.physics.catalogue.entry import complete
from tbatch.physics.catalogue.tracks import SLAB_TRACKS, WINKLER_TRACKS
from tbatch.physics.imported.checks import GivenMatrix
from tbatch.physics.imported.matrices import ImportedMatrices
from tbatch.physics.line import Line
from tbatch.physics.quantities import positive, rail_count, whole_number
from tbatch.physics.slab import SlabParameters, accept_rayleigh
from tbatch.physics.winkler import WinklerParameters


class Track(Line):
    """A line with the ways to build one."""

    @classmethod
    def slab(
        cls,
        name: str | None = None,
        *,
        length: float | str,
        elements_per_bay: int = 1,
        bay: float | None = None,
        rail: tuple[float, float] | None = None,
        fastener: tuple[float, float] | None = None,
        slab: tuple[float, float] | None = None,
        mortar: tuple[float, float] | None = None,
        base: tuple[float, float] | None = None,
        subgrade: tuple[float, float] | None = None,
        per: str | None = None,
        rayleigh: tuple[float, float] | None = None,
        rails: int | None = None,
    ) -> "Track":
        """Return a three-layer slab track: a catalogue set, a changed catalogue set, or all numbers given.

        Args:
            name: a set of the catalogue; the other arguments then replace its numbers.
            length: length [m], rounded up to whole bays; or "endless": seats at every multiple of the bay.
            elements_per_bay: elements per fastener spacing.
            bay: fastener spacing [m].
            rail: (EI [N m2], mass [kg/m]).
            fastener: (stiffness [N/m], damping [N s/m]) of a seat.
            slab: (EI [N m2], mass [kg/m]).
            mortar: (stiffness, damping) of the CA mortar [N/m, N s/m], by `per`.
            base: (EI [N m2], mass [kg/m]) of the base plate.
            subgrade: (stiffness, damping) [N/m, N s/m], by `per`.
            per: whether mortar and subgrade are per 'fastener' spacing (the default) or per 'metre'.
            rayleigh: (alpha [1/s], beta [s]): alpha M + beta K is added to the damping.
            rails: 1 or 2; default 2. It labels the numbers and never rescales them.
        """
        given = {
            "bay": bay,
            "rail": rail,
            "fastener": fastener,
            "slab": slab,
            "mortar": mortar,
            "base": base,
            "subgrade": subgrade,
            "per": per,
            "rayleigh": rayleigh,
            "rails": rails,
        }
        parameters = complete(SlabParameters, SLAB_TRACKS, "slab track", name, given)
        per_bay = whole_number("track.elements_per_bay", elements_per_bay, 1)

        def line(span: float) -> "Track":
            bays = parameters.bay_count(span)
            return cls._held_at_ends(
                "slab",
                name or "slab",
                parameters,
                parameters.matrices(bays, per_bay),
                length=bays * parameters.bay,
                period=per_bay,
                rail_EI=parameters.rail[0],
                rayleigh=parameters.rayleigh,
            )

        return _endless(line) if length == "endless" else line(positive("track.length", length, "m"))

    @classmethod
    def winkler(
        cls,
        name: str | None = None,
        *,
        length: float | str,
        elements: int | None = None,
        EI: float | None = None,
        mass: float | None = None,
        stiffness: float | None = None,
        damping: float | None = None,
        rayleigh: tuple[float, float] = (0.0, 0.0),
        rails: int | None = None,
    ) -> "Track":
        """Return a beam on a continuous bed: a catalogue set, a changed one, or all numbers given.

        Args:
            name: a set of the catalogue; the other arguments then replace its numbers.
            length: length [m], or "endless".
            elements: number of elements; by default none is longer than a fifth of (4 EI / stiffness)^¼. An endless
                track takes the default.
            EI: bending stiffness [N m2].
            mass: mass [kg/m].
            stiffness: bed stiffness [N/m2].
            damping: bed damping [N s/m2].
            rayleigh: (alpha [1/s], beta [s]): alpha M + beta K is added to the damping.
            rails: 1 or 2; default 1. It labels the numbers and never rescales them.
        """
        given = {"EI": EI, "mass": mass, "stiffness": stiffness, "damping": damping, "rails": rails}
        parameters = complete(WinklerParameters, WINKLER_TRACKS, "winkler track", name, given)

        def line(span: float, count: int) -> "Track":
            return cls._line("winkler", name or "winkler", parameters, span, count, rayleigh)

        if length == "endless":
            if elements is not None:
                raise ValueError(f"track.elements = {elements!r}: an endless track takes the default element length")
            element = 100.0 / parameters.usual_element_count(100.0)
            return _endless(
                lambda span: line(element * np.ceil(span / element - 1e-9), int(np.ceil(span / element - 1e-9)))
            )
        span = positive("track.length", length, "m")
        return line(span, parameters.usual_element_count(span) if elements is None else elements)

    @classmethod
    def beam(
        cls,
        *,
        length: float,
        elements: int,
        EI: float,
        mass: float,
        rayleigh: tuple[float, float] = (0.0, 0.0),
        rails: int | None = None,
    ) -> "Track":
        """Return a simply supported beam.

        Args:
            length: span [m].
            elements: number of elements.
            EI: bending stiffness [N m2].
            mass: mass [kg/m].
            rayleigh: (alpha [1/s], beta [s]): damping alpha M + beta K.
            rails: 1, 2 or None for either. It labels the numbers and never rescales them.
        """
        parameters = WinklerParameters(EI, mass, 0.0, 0.0, rails)
        return cls._line("beam", "beam", parameters, positive("track.length", length, "m"), elements, rayleigh)

    @classmethod
    def rigid(cls, *, length: float, rails: int | None = None) -> "Track":
        """Return a rail that does not give, `length` [m] long, without any dof."""
        none = BlockTridiagonal.zeros(2, 0)
        return cls(
            kind="rigid",
            length=positive("track.length", length, "m"),
            element_count=1,
            layers={},
            mass=none,
            damping=none,
            stiffness=none,
            pinned=np.zeros((2, 0), dtype=bool),
            period=1,
            rail_EI=None,
            rails=rail_count("track.rails", rails),
            name="rigid",
        )

    @classmethod
    def ballast(cls, *_: object, **__: object) -> "Track":
        """Refuse: ballasted tracks are not built yet."""
        raise ValueError("track 'ballast': not yet; built are slab, winkler, beam, rigid and from_matrices")

    @classmethod
    def from_matrices(
        cls,
        mass: GivenMatrix,
        damping: GivenMatrix,
        stiffness: GivenMatrix,
        *,
        rail_x: ArrayLike,
        rail_w: Sequence[int] | np.ndarray,
        rail_theta: Sequence[int] | np.ndarray | None = None,
        rail_EI: float | None = None,
        rails: int | None = None,
        name: str = "matrices",
        source: str = "",
    ) -> "Track":
        """Return a track of any matrices, as finite element software writes them; docs/substructures.md has the rules.

        Rows may stand in any order. Wheels run from the first to the last rail node.

        Args:
            mass: M [kg, kg m, kg m2], shape (n, n), dense or sparse, symmetric, no motion with a negative mass.
            damping: C [N s/m, ...], likewise.
            stiffness: K [N/m, ...], symmetric and positive definite on the dofs that are not held.
            rail_x: places of the rail's nodes [m], shape (node,), at any distances, in any order.
            rail_w: row of each node's vertical dof, from 0; -1 where it is held and not in the matrices.
            rail_theta: row of each node's rotation about the cross axis, likewise; None where the rail has none, and
                wheels then follow straight lines between its nodes.
            rail_EI: bending stiffness of the rail [N m2], for the local rail compliance; None leaves it out.
            rails: 1, 2 or None for either. It labels the numbers and never rescales them.
            name: name in messages and tables.
            source: where the matrices come from.

        Raises:
            ValueError: Naming the matrix, the entry and what is accepted.
        """
        matrices = ImportedMatrices.of(mass, damping, stiffness, rail_x, rail_w, rail_theta)
        return cls(
            **matrices.line(rail_EI),
            kind="matrices",
            layers={"rail": (0, 1)},
            period=1,
            rails=rail_count("track.rails", rails),
            name=name,
            source=source,
            imported=matrices,
        )

    @classmethod
    def from_files(
        cls,
        *,
        mass: str | Path,
        stiffness: str | Path,
        nodes: str | Path,
        damping: str | Path | None = None,
        mapping: str | Path | None = None,
        units: str = "m-kg-s",
        offset: float = 0.0,
        rayleigh: tuple[float, float] = (0.0, 0.0),
        rail_EI: float | None = None,
        rails: int | None = None,
    ) -> "Track":
        """Return a track of matrices that finite element software wrote; docs/exporting_matrices.md has the formats.

        Args:
            mass: file of M; "FILE#NAME" picks one of several matrices of a Nastran file.
            stiffness: file of K.
            nodes: file of the node map: the rail's nodes, their x and their dofs.
            damping: file of C; None for none but `rayleigh`.
            mapping: ANSYS mapping file, so that the node map of a Harwell-Boeing matrix can name nodes and dofs.
            units: units of the matrices, "m-kg-s" or "mm-t-s".
            offset: added to the x of the node map [m].
            rayleigh: (alpha [1/s], beta [s]): alpha M + beta K is added to the damping.
            rail_EI: bending stiffness of the rail [N m2], for the local rail compliance; None leaves it out.
            rails: 1, 2 or None for either. It labels the numbers and never rescales them.

        Raises:
            ValueError: Naming the file, and the line or the entry.
        """
        from tbatch.physics.substructure.substructure import Substructure

        files = Substructure.read(
            mass=mass, stiffness=stiffness, nodes=nodes, damping=damping, mapping=mapping, units=units, offset=offset
        )
        return files.track(rail_EI=rail_EI, rails=rails, rayleigh=rayleigh)

    @classmethod
    def _line(
        cls,
        kind: str,
        name: str,
        parameters: WinklerParameters,
        length: float,
        elements: int,
        rayleigh: tuple[float, float],
    ) -> "Track":
        """Return a beam, with or without a bed."""
        count = whole_number("track.elements", elements, 1)
        matrices = parameters.matrices(length, count)
        return cls._held_at_ends(
            kind,
            name,
            parameters,
            matrices,
            length=length,
            period=1,
            rail_EI=parameters.EI,
            rayleigh=accept_rayleigh(rayleigh),
        )

    @classmethod
    def _held_at_ends(
        cls,
        kind: str,
        name: str,
        parameters: SlabParameters | WinklerParameters,
        matrices: tuple[BlockTridiagonal, ...],
        *,
        length: float,
        period: int,
        rail_EI: float,
        rayleigh: tuple[float, float],
    ) -> "Track":
        """Return the track with its Rayleigh damping and with the vertical dofs of all layers pinned at both ends."""
        mass, damping, stiffness = matrices
        alpha, beta = rayleigh
        if alpha or beta:
            damping = damping + mass * alpha + stiffness * beta
        pinned = np.zeros((mass.node_count, mass.node_dofs), dtype=bool)
        pinned[np.ix_([0, -1], [w for w, _ in parameters.layers.values()])] = True
        pinned.setflags(write=False)
        return cls(
            kind=kind,
            length=length,
            element_count=mass.node_count - 1,
            layers=parameters.layers,
            mass=mass.pinned(pinned),
            damping=damping.pinned(pinned),
            stiffness=stiffness.pinned(pinned),
            pinned=pinned,
            period=period,
            rail_EI=rail_EI,
            rails=parameters.rails,
            name=name,
            source=parameters.source,
            parameters=parameters,
        )


def _endless(line: Callable[[float], Track]) -> Track:
    """Return an endless track; the line it holds is a short stand-in until a window is made for a vehicle."""

    def window(length: float) -> Track:
        return replace(line(length), window=window)

    return window(20.0)
