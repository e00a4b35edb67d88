"""Calls the program as 3D Slicer calls a module: slicer_test.py PROGRAM SOURCE_FOLDER.

What Slicer does of a description is written here anew, by its documentation: parameters with a flag in the order of the
description, numbers and choices always, switches where they are on, all else where it is not empty, then the arguments
by their index. Skipped parts say so; the exit code is 77 where the description could not be validated.
"""
import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

import numpy

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
VERBS = ["register", "warp", "atlas", "audit"]
MODULES = {"register": "PulsonRegister", "warp": "PulsonWarpPoints", "atlas": "PulsonAtlas", "audit": "PulsonAudit"}
ALWAYS = {"integer", "float", "double", "string-enumeration"}


def run(*words, code=0, module=False):
    """The program; as a module through the script that Slicer finds, with Slicer's libraries in the way."""
    command = [os.path.join(SOURCE, "bindings", "slicer", MODULES[words[0]]), *words[1:]] if module else [PROGRAM, *words]
    environment = {**os.environ, "PULSON": PROGRAM, "LD_LIBRARY_PATH": "/nowhere"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment if module else None)
    assert done.returncode == code, (words, done.returncode, done.stderr)
    return done


def parameters(xml):
    return [element for group in ElementTree.fromstring(xml).findall("parameters") for element in group
            if element.find("name") is not None]


def text(element, name):
    found = element.find(name)
    return found.text if found is not None and found.text else ""


def call(verb, xml, panel):
    """The command line that Slicer makes of the values in its panel."""
    words, arguments, known = [verb], {}, set()
    for element in parameters(xml):
        name = text(element, "name")
        known.add(name)
        value = panel.get(name, text(element, "default"))
        if element.find("index") is not None:
            assert value, f"Slicer needs a value of {name}"
            arguments[int(text(element, "index"))] = value
            continue
        flag = "--" + text(element, "longflag").lstrip("-")
        if element.tag == "boolean":
            words += [flag] if value == "true" else []
        elif element.tag in ALWAYS or value:
            words += [flag, value]
    assert not set(panel) - known, set(panel) - known
    return words + [arguments[index] for index in sorted(arguments)]


def write_markups(path, points, axes):
    """As Slicer saves a list of points."""
    ras = numpy.array([1, 1, 1]) if axes == "LPS" else numpy.array([-1, -1, 1])
    markups = {"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/"
                          "Schema/markups-schema-v1.0.3.json#",
               "markups": [{"type": "Fiducial", "coordinateSystem": axes, "coordinateUnits": "mm",
                            "controlPoints": [{"id": str(i + 1), "label": f"F-{i + 1}",
                                               "position": (ras * point).tolist(), "positionStatus": "defined"}
                                              for i, point in enumerate(points)]}]}
    with open(path, "w") as file:
        json.dump(markups, file)


def read_markups(path):
    """Positions in LPS, as Slicer reads them; it needs these keys."""
    with open(path) as file:
        held = json.load(file)
    assert re.search(r"markups-schema-v1\.0\.\d\.json", held["@schema"]), held["@schema"]
    (markup,) = held["markups"]
    assert markup["type"] == "Fiducial" and markup["coordinateSystem"] in ("LPS", "RAS")
    assert markup["coordinateUnits"] == "mm"
    ras = numpy.array([1, 1, 1]) if markup["coordinateSystem"] == "LPS" else numpy.array([-1, -1, 1])
    for point in markup["controlPoints"]:
        assert point["positionStatus"] == "defined" and len(point["position"]) == 3
        assert numpy.allclose(numpy.reshape(point["orientation"], (3, 3)), -numpy.diag([1, 1, -1]) if ras[0] == 1
                              else numpy.eye(3)), "Slicer's axes, RAS, in those of the file"
    return numpy.array([ras * point["position"] for point in markup["controlPoints"]])


def read_field(path):
    """Grid and vectors of an NRRD file, by http://teem.sourceforge.net/nrrd/format.html: origin, spacing, [z][y][x][3]."""
    with open(path, "rb") as file:
        header, data = file.read().split(b"\n\n", 1)
    lines = header.decode().split("\n")
    assert re.fullmatch(r"NRRD000[1-5]", lines[0])
    fields = dict(line.split(": ", 1) for line in lines[1:] if not line.startswith("#") and ":=" not in line)
    assert fields["dimension"] == "4" and fields["space"] == "left-posterior-superior"
    assert fields["kinds"].split() == ["vector", "domain", "domain", "domain"], fields["kinds"]
    assert fields["type"] == "float" and fields["endian"] == "little" and "measurement frame" not in fields
    none, *directions = fields["space directions"].split()
    assert none == "none"
    directions = numpy.array([[float(x) for x in each.strip("()").split(",")] for each in directions])
    assert numpy.array_equal(directions, numpy.diag(numpy.diag(directions)))
    origin = numpy.array([float(x) for x in fields["space origin"].strip("()").split(",")])
    sizes = [int(x) for x in fields["sizes"].split()]
    assert sizes[0] == 3
    data = gzip.decompress(data) if fields["encoding"] == "gzip" else data
    return origin, numpy.diag(directions), numpy.frombuffer(data, "<f4").reshape(sizes[::-1])


def displaced(field, places):
    """x + u(x) with u by trilinear interpolation, as ITK has it."""
    origin, spacing, values = field
    result = []
    for place in places:
        at = (place - origin) / spacing
        cell = numpy.floor(at).astype(int)
        part = at - cell
        u = numpy.zeros(3)
        for corner in numpy.ndindex(2, 2, 2):
            weight = numpy.prod([part[axis] if corner[axis] else 1 - part[axis] for axis in range(3)])
            x, y, z = cell + corner
            u += weight * values[z, y, x]
        result.append(place + u)
    return numpy.array(result)


def check_descriptions():
    xml = {}
    schema = os.path.join(SOURCE, "tests", "slicer", "module_description.rng")
    is_valid = shutil.which("xmllint") is not None
    for verb in VERBS:
        done = run(verb, "--xml", module=True)
        assert done.stderr == "", done.stderr
        xml[verb] = done.stdout
        with open(f"{verb}.xml", "w") as file:
            file.write(done.stdout)
        if is_valid:
            lint = subprocess.run(["xmllint", "--noout", "--relaxng", schema, f"{verb}.xml"], capture_output=True, text=True)
            assert lint.returncode == 0, lint.stderr
        elements = parameters(done.stdout)
        names = [text(element, "name") for element in elements]
        assert len(set(names)) == len(names), names
        for element in elements:
            if element.tag == "string-enumeration":
                assert text(element, "default") in [choice.text for choice in element.findall("element")]
        # The table of --help-all and the description are of the same options.
        helped = set(re.findall(r"--([a-z][-a-z]*)", re.sub(r"\(not with[^)]*\)", "", run(verb, "--help-all").stdout)))
        flags = {text(element, "longflag").lstrip("-") for element in elements} - {""}
        assert flags <= helped, flags - helped
        if verb != "warp":
            assert not {"kernel", "noise", "sigma", "align", "missing", "by-order"} & helped - flags
    assert "pixel-size" not in {text(element, "longflag").lstrip("-") for element in parameters(xml["warp"])}
    done = run("compare", "--xml", code=2)
    assert "unknown option '--xml'" in done.stderr, done.stderr
    return xml, is_valid


def check_register_and_warp(xml):
    random = numpy.random.default_rng(7)
    source = random.uniform(-40, 40, (12, 3)) + [10, -20, 100]
    target = source + 3 * numpy.sin(source[:, ::-1] / 30) + [4, 2, -1]
    write_markups("source.mrk.json", source, "LPS")
    write_markups("target.mrk.json", target, "RAS")
    # What is in the panel at first; a mark of missing landmarks takes several values, and must not take the arguments.
    panel = {"source": "source.mrk.json", "target": "target.mrk.json", "out": "fit", "missing": "9999",
             "no_picture": "true"}
    run(*call("register", xml["register"], panel), module=True)
    run("register", "source.mrk.json", "target.mrk.json", "-o", "plain", "--no-picture")
    fits = []
    for folder in ("fit", "plain"):
        with open(f"{folder}/registration.json") as file:
            fits.append(json.load(file))
    for key in ("momenta", "result", "kernel", "lambda", "sigma", "rms", "mode", "integrator", "steps"):
        assert fits[0][key] == fits[1][key], f"{key}: what Slicer's panel shows is not the default"
    assert fits[0]["matched"]

    panel = {"registration": "fit/registration.json", "input": "source.mrk.json", "out": "moved.mrk.json",
             "field": "field.nrrd", "grid_points": "17"}
    run(*call("warp", xml["warp"], panel), module=True)
    moved = read_markups("moved.mrk.json")
    rms = numpy.sqrt(numpy.mean(numpy.sum((moved - target) ** 2, axis=1)))
    assert abs(rms - fits[0]["rms"]) < 1e-9 and rms < fits[0]["sigma"], (rms, fits[0]["rms"])
    # The field leads from what was moved back to where it was, and the other one there.
    back = displaced(read_field("field.nrrd"), moved)
    assert numpy.abs(back - source).max() < 1, numpy.abs(back - source).max()
    run(*call("warp", xml["warp"], {**panel, "inverse": "true", "input": "target.mrk.json", "out": "back.mrk.json",
                                    "field": "forward.nrrd"}), module=True)
    there = displaced(read_field("forward.nrrd"), source)
    assert numpy.abs(there - moved).max() < 1, numpy.abs(there - moved).max()
    # Finer, and nearer: the rest is interpolation.
    run(*call("warp", xml["warp"], {**panel, "grid_points": "33", "field": "fine.nrrd"}), module=True)
    fine = numpy.abs(displaced(read_field("fine.nrrd"), moved) - source).max()
    assert fine < 0.4 * numpy.abs(back - source).max(), (fine, numpy.abs(back - source).max())

    # The same in RAS, of both: the field is in LPS whatever the lists are in.
    write_markups("source_ras.mrk.json", source, "RAS")
    run("register", "source_ras.mrk.json", "target.mrk.json", "-o", "ras", "--no-picture")
    run("warp", "ras/registration.json", "source.mrk.json", "-o", "moved_ras.mrk.json", "--field", "ras.nrrd",
        "--grid-points", "17")
    assert numpy.allclose(read_markups("moved_ras.mrk.json"), moved, atol=1e-6)
    assert numpy.allclose(displaced(read_field("ras.nrrd"), moved), back, atol=1e-4)

    # What cannot be is refused, with the way out.
    run("register", "source.mrk.json", "target.mrk.json", "-o", "noisy", "--no-picture", "--noise", "ch-sd:beta=5%")
    noisy = run("warp", "noisy/registration.json", "source.mrk.json", "-o", "n.mrk.json", "--field", "n.nrrd", code=2)
    assert "--noise none" in noisy.stderr and not os.path.exists("n.mrk.json"), noisy.stderr
    flat = os.path.join(SOURCE, "sample_shapes", "leaves.tps")
    run("register", flat + "#1", flat + "#2", "-o", "flat", "--no-picture")
    refused = run("warp", "flat/registration.json", flat + "#1", "-o", "f.csv", "--field", "f.nrrd", code=2)
    assert "give the image" in refused.stderr, refused.stderr


def check_cohorts(xml):
    leaves = os.path.join(SOURCE, "sample_shapes", "leaves.tps")
    run(*call("atlas", xml["atlas"], {"cohort": leaves, "out": "atlas", "no_picture": "true"}), module=True)
    run("atlas", leaves, "-o", "plain_atlas", "--no-picture")
    atlases = []
    for folder in ("atlas", "plain_atlas"):
        with open(f"{folder}/atlas.json") as file:
            atlases.append(json.load(file))
    for key in ("template", "kernel", "lambda", "sigma", "modes"):
        assert atlases[0][key] == atlases[1][key], key
    run("convert", leaves + "#5", "wrong.tps", "--landmarks", "1-9,17,11-16,10,18,19")
    run("convert", leaves + "#1", "wrong.tps", "--out", "pair.tps")
    run(*call("audit", xml["audit"], {"files": "pair.tps", "out": "audit", "fix": "mended.tps"}), module=True)
    with open("audit/audit.json") as file:
        assert json.load(file)["findings"], "exchanged landmarks are found"


def main():
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        xml, is_valid = check_descriptions()
        check_register_and_warp(xml)
        check_cohorts(xml)
        os.chdir("/")
    if not is_valid:
        print("skipped: there is no xmllint to validate the descriptions with")
        sys.exit(77)


main()
