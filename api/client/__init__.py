"""A client of the service: campaigns, rigs and run files over HTTP, typed, with deadlines and safe repetition."""

from api.client.answers import Campaign, Rig, RigStop, RunFile, Test
from api.client.client import Client
from api.client.credentials import Service, find_service

__all__ = ["Campaign", "Client", "Rig", "RigStop", "RunFile", "Service", "Test", "find_service"]
