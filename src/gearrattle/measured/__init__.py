"""Measured files: their contents, recordings read from them by a mapping, and inputs of a model made of them."""

from gearrattle.measured.drive import drive
from gearrattle.measured.look import look
from gearrattle.recording import Channel, Recording

__all__ = ["Channel", "Recording", "drive", "look"]
