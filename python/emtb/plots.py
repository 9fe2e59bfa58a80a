"""Pictures, where matplotlib is installed."""
from .files import EmtbError

UNITS = {"u_ref": "V", "e_a": "V", "i_a": "A", "omega": "rad/s", "theta": "rad", "torque": "N m", "i_f": "A", "temperature": "degC"}


def plot(run, out, signals=None):
    """Draws signals of a run under each other, over time, into a file. Returns the file."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        raise EmtbError("plot() needs matplotlib: install python3-matplotlib; all else does without") from None
    names = [name for name in (signals or run) if name in run]
    if not names:
        raise EmtbError(f"{run.name} has none of {', '.join(signals or ['any signal'])}")
    figure, axes = pyplot.subplots(len(names), 1, sharex=True, squeeze=False, figsize=(8, 1.8 * len(names)))
    for axis, name in zip(axes[:, 0], names):
        axis.plot(*run[name], linewidth=1)
        axis.set_ylabel(f"{name} [{UNITS.get(name, '')}]")
        axis.grid(alpha=0.3)
    axes[-1, 0].set_xlabel("t [s]")
    figure.suptitle(run.name)
    figure.savefig(out, dpi=120, bbox_inches="tight")
    pyplot.close(figure)
    return out
