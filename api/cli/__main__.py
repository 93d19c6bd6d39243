"""``python -m api.cli`` is ``damper-rig``: how a program starts it as a process of its own."""

from api.cli.main import run

if __name__ == "__main__":
    run()
