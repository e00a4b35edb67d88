#!/usr/bin/env python3
"""Checks that registrations with all defaults do not depend on the unit of length.

Each pair of shapes is written in the unit of its file and with its coordinates multiplied by each factor (0.001 and
1000), and registered with all defaults. A line for each pair, and one for the worst, gives the largest differences from
the first: of the end points q(T) relative to the diameter of the aligned source, of the cost J relative to J, and of the
momenta relative to the largest. Exits with 1 where one is above 1e-6. Factors that are powers of two round nothing: then
all bits are the same, also of searches that do not converge.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

LIMIT = 1e-6
NOT_CONVERGED = 3


class Refused(Exception):
    pass


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    if done.returncode not in (0, NOT_CONVERGED):
        raise Refused(done.stderr.strip())


def read_table(pulson, address, folder):
    """The rows of the csv table that `pulson convert` makes of a shape."""
    path = folder / 'converted.csv'
    run(pulson, 'convert', address, '--out', str(path))
    with open(path, newline='') as file:
        return list(csv.reader(file))


def write_scaled(table, scale, path):
    axes = [i for i, name in enumerate(table[0]) if name in ('x', 'y', 'z')]
    with open(path, 'w', newline='') as file:
        rows = csv.writer(file)
        rows.writerow(table[0])
        for row in table[1:]:
            rows.writerow([repr(float(cell) * scale) if i in axes and cell != 'NA' else cell for i, cell in enumerate(row)])


def register(pulson, tables, scale, folder, options):
    paths = [str(folder / name) for name in ('source.csv', 'target.csv')]
    for table, path in zip(tables, paths):
        write_scaled(table, scale, path)
    run(pulson, 'register', *paths, '-o', str(folder / 'out'), '--no-picture', '--quiet', *options)
    return json.loads((folder / 'out' / 'registration.json').read_text())


def flat(points):
    return [x for point in points for x in point]


def largest_difference(points, first, scale):
    return max(abs(a / scale - b) for a, b in zip(flat(points), flat(first)))


def diameter(points):
    return max(math.dist(a, b) for a in points for b in points)


def compare(pulson, source, target, scales, folder, options):
    tables = [read_table(pulson, address, folder) for address in (source, target)]
    first = register(pulson, tables, 1, folder, options)
    size = diameter(first['source'])
    largest = max(abs(x) for x in flat(first['momenta'])) or 1
    errors = [0, 0, 0]
    for scale in scales:
        other = register(pulson, tables, scale, folder, options)
        cost = first['cost']['total']
        found = (largest_difference(other['result'], first['result'], scale) / size,
                 abs(other['cost']['total'] - cost) / max(cost, 1e-9),
                 largest_difference(other['momenta'], first['momenta'], scale) / largest)
        errors = [max(pair) for pair in zip(errors, found)]
    return first, errors


def name_of(address):
    path, mark, shape = address.partition('#')
    return pathlib.Path(path).name + mark + shape


def read_arguments():
    arguments, options = sys.argv[1:], []
    if '--' in arguments:
        options = arguments[arguments.index('--') + 1:]
        arguments = arguments[:arguments.index('--')]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog='Options after -- are those of register.')
    parser.add_argument('--factors', default='0.001,1000', help='[0.001,1000]')
    parser.add_argument('pulson', help='the program')
    parser.add_argument('shapes', nargs='+', metavar='SHAPES',
                        help='SOURCE,TARGET or a file of several shapes, of which the first two are registered')
    read = parser.parse_args(arguments)
    return read.pulson, read.shapes, [float(factor) for factor in read.factors.split(',')], options


def main():
    pulson, shapes, scales, options = read_arguments()
    worst, bad, refused = [0, 0, 0], 0, 0
    with tempfile.TemporaryDirectory() as name:
        for text in shapes:
            source, comma, target = text.partition(',')
            if not comma:
                source, target = f'{text}#1', f'{text}#2'
            try:
                first, errors = compare(pulson, source, target, scales, pathlib.Path(name), options)
            except Refused as error:
                refused += 1
                print(f'refused  {name_of(source)}, {name_of(target)}: {error}')
                continue
            is_bad = not max(errors) <= LIMIT
            bad += is_bad
            worst = [max(pair) for pair in zip(worst, errors)]
            print(f'{"DIFFERS" if is_bad else "same":8} {name_of(source)}, {name_of(target)}: '
                  f'{len(first["source"])} landmarks in {len(first["source"][0])}D, q(T) {errors[0]:.1e}, J {errors[1]:.1e}, '
                  f'momenta {errors[2]:.1e}{"" if first["converged"] else "; not converged"}', flush=True)
    print(f'{len(shapes) - refused} pairs, {bad} above {LIMIT:g}, {refused} refused; largest differences: '
          f'q(T) {worst[0]:.1e}, J {worst[1]:.1e}, momenta {worst[2]:.1e}')
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
