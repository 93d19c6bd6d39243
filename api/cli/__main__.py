"""``python -m api.cli`` is ``damper-rig``: how another program starts it as a process."""

from api.cli.main import run

if __name__ == "__main__":
    run()
