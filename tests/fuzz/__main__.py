"""The long run: `python -m tests.fuzz READER --seconds 600`; without a reader it lists them."""

import argparse
import sys
from pathlib import Path

from tests.fuzz.readers import READERS
from tests.fuzz.run import best_engine, fuzz


def main() -> int:
    """Exit code 1 if anything but a sound value or a sentence came out."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("readers", nargs="*", help=f"any of {', '.join(READERS)}, or 'all'")
    parser.add_argument("--seconds", type=float, default=600, help="for each reader, default 600")
    parser.add_argument("--engine", choices=("auto", "atheris", "mutate"), default="auto")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path, default=Path("fuzz"), help="folder for inputs at fault")
    args = parser.parse_args()
    if not args.readers:
        print("\n".join(READERS))
        return 0
    engine = best_engine() if args.engine == "auto" else args.engine
    names = list(READERS) if args.readers == ["all"] else args.readers
    is_clean = True
    for name in names:
        if name not in READERS:
            parser.error(f"no reader {name!r}; there are {', '.join(READERS)}")
        outcome = fuzz(name, args.output / name, engine=engine, seed=args.seed, seconds=args.seconds)
        print(
            f"{name:18} {outcome.engine} {outcome.inputs:>10,} inputs {outcome.seconds:6.0f} s"
            f" {outcome.crashes:3} crashes {outcome.hangs:3} hangs {len(outcome.faults):3} faults"
            f" {outcome.worst_memory / 2**20:6.1f} MiB at most",
            flush=True,
        )
        for fault in outcome.faults:
            print(f"    {args.output / name / fault['input']}: {fault['what'][:300]}", flush=True)
        is_clean &= outcome.is_clean
    return 0 if is_clean else 1


if __name__ == "__main__":
    sys.exit(main())
