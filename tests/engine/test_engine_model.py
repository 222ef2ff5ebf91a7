"""A model is factorised once, and models that have a track and a step in common share that."""

from tbatch.engine.model import Model
from tbatch.physics.contact import Contact
from tbatch.physics.track import Track
from tbatch.physics.vehicle import Vehicle


def test_models_on_one_track_share_its_factorisation_and_its_window():
    track, contact = Track.slab("seed-slab", length=32.0), Contact.hertz(wheel_radius=0.4575)
    coach, light = Vehicle.coach("seed-multiwheel"), Vehicle.coach("seed-multiwheel", wheelset_mass=1500.0)
    models = [Model.build(vehicle, track, contact, step=1e-4) for vehicle in (coach, light)]
    assert models[0].factor is models[1].factor
    assert Model.build(coach, track, contact, step=5e-5).factor is not models[0].factor
    endless = Track.winkler("koh-winkler", length="endless")
    column = Vehicle.column("koh-column")
    moving = [Model.build(column, endless, contact, step=step, window_tolerance=0.05) for step in (1e-4, 5e-5)]
    assert moving[0].track is moving[1].track
    assert moving[0].factor is not moving[1].factor
