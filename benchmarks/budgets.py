#!/usr/bin/env python3
"""Measures what pulson's programs cost against their budgets.

Each row runs one command with its defaults and prints its processor time (user and system, of the child alone), its
largest memory, the goal, and the ratio of the two. Rows whose unit is ns divide the time by what it is for, those in ms
by the effective draws of the worst number of the paths. Shapes and images are made here; `--data` is a folder of real
landmark files, without which their rows are left out.

Usage: benchmarks/budgets.py build/dev/bin/pulson [--data FOLDER] [--problems FOLDER] [--only PATTERN] [--limit SECONDS]
"""
import argparse
import json
import math
import os
import pathlib
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

import many_landmarks


def write_line(folder, name, count):
    """Markers with random gaps; in the target a run of 60 is in reverse order and all have moved a little."""
    random.seed(1)
    source = [0.0]
    for _ in range(count - 1):
        source.append(source[-1] + random.expovariate(count / 100))
    target = [x + 2 * math.sin(x / 20) for x in source]
    first, last = count // 3, count // 3 + 60
    target[first:last] = target[first:last][::-1]
    for role, places in (('source', source), ('target', target)):
        rows = [f'm{i},{x:.9f}\n' for i, x in enumerate(places)]
        (folder / f'{name}_{role}.csv').write_text('name,x\n' + ''.join(rows))


def write_png(path, side):
    """A grey image of side x side pixels with a texture."""
    rows = []
    for r in range(side):
        row = bytes((r * 3 + (c >> 4) * 7) & 255 for c in range(0, side, 8))
        rows.append(b'\0' + bytes(b for b in row for _ in range(8)))
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    path.write_bytes(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', side, side, 8, 0, 0, 0, 0)) +
                     chunk(b'IDAT', zlib.compress(b''.join(rows), 1)) + chunk(b'IEND', b''))


def write_pixels(folder, side):
    """1000 landmarks of an outline in an image of that side, in pixels."""
    for role, points in zip(('source', 'target'), many_landmarks.outline(1000)):
        scaled = [f'{side / 2 + side / 4 * x:.6f},{side / 2 + side / 4 * y:.6f}\n' for x, y in points]
        (folder / f'pixels_{role}.csv').write_text('x,y\n' + ''.join(scaled))


def prepare(folder):
    for name, shapes in (('outline50', many_landmarks.outline(50)), ('outline10', many_landmarks.outline(10)),
                         ('outline10000', many_landmarks.outline(10000)), ('sphere399', many_landmarks.sphere(399))):
        many_landmarks.write_problem(folder, name, shapes)
    write_line(folder, 'line10000', 10000)
    write_pixels(folder, 4000)
    write_png(folder / 'image.png', 4000)


SCREENED = 'ch-sd-screened:beta=0.01,gamma=0.1'
FITTED = '--align none --lambda 1 --kernel gaussian:alpha=0.6 --sigma 0.002'
START = '--align none --lambda 1 --kernel gaussian:alpha=0.4 --sigma 0.05'
STEPS = 50


def lanes(count, noise, integrator, goal, samples):
    """A row in ns per path, step and N²."""
    return (f'{noise.split(":")[0]}, {integrator}, N = {count}',
            f'ensemble --from {{f}}/start{count}/registration.json --noise {noise} --integrator {integrator} '
            f'--samples {samples} --steps {STEPS} --records 2 --no-picture', goal, samples * STEPS * count * count)


def effective_draws(out):
    """Of the path's worst number; None of chains that did not converge."""
    summary = json.loads((out / 'summary.json').read_text())
    return summary['path']['ess_min'] if summary['converged'] else None


def rows(data, problems):
    yield lanes(50, 'ch-sd:beta=0.02', 'variational', 0.7, 6400)
    yield lanes(50, SCREENED, 'variational', 5, 1280)
    yield lanes(10, 'p-sd:beta=0.02,fields=grid,count=4', 'variational', 5, 12800)
    yield lanes(50, 'p-sd:beta=0.02,fields=grid,count=4', 'variational', 5, 1280)
    for integrator in ('heun', 'variational'):
        yield lanes(10, 'kunita:beta=0.02', integrator, 10, 12800)
    for integrator in ('heun', 'midpoint', 'variational-2'):
        yield lanes(10, 'ch-sd:beta=0.02', integrator, 7, 12800)
    yield ('ensemble, one screened path of N = 50',
           f'ensemble --from {{f}}/start50/registration.json --noise {SCREENED} --samples 1 --steps 50', 0.05, None)
    yield ('ensemble, the pair, 50,048 paths',
           'ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 --samples 50048', 0.8, None)
    if data and (data / 'papilionidae_butterflies').exists():
        yield ('butterfly, 1000 points', 'register {d}/papilionidae_butterflies/Papilionidae_landmarks.txt#1 '
               '{d}/papilionidae_butterflies/Papilionidae_landmarks.txt#20', 4, None)
    yield ('outline of 10,000', 'register {f}/outline10000_source.csv {f}/outline10000_target.csv ' + FITTED, 3.5, None)
    if problems and (problems / 'S3_500_source.csv').exists():
        yield ('S3_500', 'register {p}/S3_500_source.csv {p}/S3_500_target.csv ' + FITTED, 2, None)
    yield ('399 points in 3D, ch-sd 2 %',
           'register {f}/sphere399_source.csv {f}/sphere399_target.csv --noise ch-sd:beta=2%', 5, None)
    yield ('warp, 16 MP, 1000 landmarks', 'warp {f}/pixels/registration.json {f}/image.png', 5, None)
    if data and (data / '1d_mouse_chr14').exists():
        for kernel in ('auto', 'matern32:alpha=auto', 'peakon:alpha=auto'):
            yield (f'489 markers of a line, {kernel}',
                   'register {d}/1d_mouse_chr14/chr14_all_38.csv {d}/1d_mouse_chr14/chr14_all_39.csv '
                   f'--kernel {kernel} --noise ch-sd:beta=2%', 0.3, None)
    yield ('10,000 markers of a line', 'register {f}/line10000_source.csv {f}/line10000_target.csv '
           '--noise ch-sd:beta=2%', 10, None)
    if data and (data / 'bridgelandmarks').exists():
        dense = ' --momenta smooth --method rto --steps 10 --warmup 150'
        for what, name, more, goal in (('cardiac, 11 points, ch-sd', 'cardiac', '', 0.56),
                                       ('corpus callosum, 77 points, ch-sd', 'dgs_cc', dense, 750)):
            yield (f'sample, {what}', f'sample {{d}}/bridgelandmarks/{name}_obs0.csv '
                   f'{{d}}/bridgelandmarks/{name}_obsT.csv#1 --noise ch-sd:beta=2%{more}', goal, effective_draws)


def measure(command, limit):
    """(processor seconds, MB, exit code) of a command; None in place of the code where it was stopped."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1)))
    error = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    code = None if status & 127 else status >> 8
    if code not in (0, 3, None):
        sys.exit(f'{" ".join(map(str, command))}: {error.decode().strip()}')
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, code


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('pulson')
    parser.add_argument('--data', type=pathlib.Path, help='folder of real landmark files')
    parser.add_argument('--problems', type=pathlib.Path, help='folder of S3_500_source.csv and so on')
    parser.add_argument('--only', default='.')
    parser.add_argument('--limit', type=int, default=60, help='processor seconds of a command')
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        prepare(folder)
        def command(text, out):
            words = text.format(f=folder, d=arguments.data, p=arguments.problems).split()
            return [arguments.pulson, *words, '-o', folder / out, '--threads', '1', '--quiet']
        for start in ('outline50', 'outline10'):
            measure(command(f'register {{f}}/{start}_source.csv {{f}}/{start}_target.csv ' + START,
                            start.replace('outline', 'start')), arguments.limit)
        measure(command('register {f}/pixels_source.csv {f}/pixels_target.csv', 'pixels'), arguments.limit)
        print('| work | goal | CPU s, ns or ms | times the goal | MB |\n|---|---|---|---|---|')
        for what, text, goal, work in rows(arguments.data, arguments.problems):
            if not re.search(arguments.only, what):
                continue
            out = 'out.png' if text.startswith('warp') else 'out'
            seconds, megabytes, code = measure(command(text, out), arguments.limit)
            of_draws = work is effective_draws
            units = work(folder / out) if of_draws and code == 0 else None if of_draws else work
            spent = seconds * (1e3 if of_draws else 1e9) / units if units else seconds
            mark = '> ' if code is None else ''
            if of_draws and not units:
                mark, spent, ratio = f'{mark}{seconds:.3g} s, not converged', None, ''
            else:
                ratio = f'{mark}{spent / goal:.3g}'
            unit = ' ms' if of_draws else ' ns' if work else ''
            print(f'| {what} | {goal}{unit} | {mark}{"" if spent is None else f"{spent:.3g}"} | {ratio} | '
                  f'{megabytes:.0f} |', flush=True)
            shutil.rmtree(folder / 'out', ignore_errors=True)


if __name__ == '__main__':
    main()
