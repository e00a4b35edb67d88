// Parts of runs of independent units: what is written is read back, and what makes no whole is named.

#include "records/unit_parts.hpp"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "core/checksum.hpp"
#include "error_of.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::records {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Landmarks full_shape() {
  Landmarks shape;
  shape.points = (Points(2, 3) << 0.1, 1, 2, std::numeric_limits<double>::quiet_NaN(), 1e-300, -3).finished();
  shape.labels = {"tip", "µ", "c"};
  shape.groups = {"a", "a", "b"};
  shape.name = "specimen";
  shape.image = "a.png";
  shape.scale = 0.1;
  shape.properties = {{"COMMENT", "text"}, {"ID", "7"}};
  shape.curves = {(Points(2, 2) << 0, 1, 2, 3).finished()};
  shape.outlines = {(Points(2, 1) << 5, 6).finished()};
  shape.numbers = {2, 5, 9};
  shape.units = "mm";
  shape.axes = "LPS";
  shape.frame.y_down = true;
  shape.source = "a.tps#1";
  return shape;
}

/// Shard `index` of `count` of eight units, whose results are their squares.
UnitRun shard_of(int index, int count) {
  UnitRun run;
  run.verb = "sample";
  run.settings = "[sample]\nseed = 1\nsteps = 4\n";
  run.shapes = {full_shape()};
  run.notes = {"a note"};
  run.facts = {{"models", {1, 2}}};
  run.shard = {index, count};
  run.units = 8;
  for (const int unit : run.own_units()) run.results[unit] = {{"square", unit * unit}};
  run.seconds = 1.5;
  return run;
}

UnitRun read_back(const UnitRun& run) { return read_unit_part(unit_part(run), "part"); }

std::string names(const UnitRun& run) { return "part-" + std::to_string(run.shard.index); }

UnitRun merged(const std::vector<UnitRun>& parts) {
  std::vector<std::string> files;
  for (const UnitRun& part : parts) files.push_back(names(part));
  return merge_units(parts, files);
}

TEST(UnitParts, ReadBackWhatWasWritten) {
  const UnitRun run = shard_of(2, 3);
  const UnitRun read = read_back(run);
  EXPECT_EQ(unit_part(read), unit_part(run));
  const Landmarks& shape = read.shapes.at(0);
  const Landmarks expected = full_shape();
  EXPECT_EQ(shape.points.rightCols(2), expected.points.rightCols(2));
  EXPECT_TRUE(std::isnan(shape.points(1, 0)));
  EXPECT_EQ(shape.labels, expected.labels);
  EXPECT_EQ(shape.groups, expected.groups);
  EXPECT_EQ(shape.name + shape.image + shape.units + shape.axes + shape.source, "specimena.pngmmLPSa.tps#1");
  EXPECT_EQ(shape.scale, expected.scale);
  EXPECT_EQ(shape.properties, expected.properties);
  EXPECT_EQ(shape.curves, expected.curves);
  EXPECT_EQ(shape.outlines, expected.outlines);
  EXPECT_EQ(shape.numbers, expected.numbers);
  EXPECT_TRUE(shape.frame.y_down);
  EXPECT_THAT(read.notes, ElementsAre("a note"));
  EXPECT_TRUE(is_unit_part(unit_part(run)));
  EXPECT_FALSE(is_unit_part("pulson"));
}

TEST(UnitParts, ShareOutAllUnits) {
  EXPECT_THAT(shard_of(1, 3).own_units(), ElementsAre(0, 3, 6));
  EXPECT_THAT(shard_of(3, 3).own_units(), ElementsAre(2, 5));
  EXPECT_FALSE(shard_of(3, 3).partial());
}

TEST(UnitParts, MergeInAnyOrder) {
  const UnitRun whole = shard_of(1, 1);
  const UnitRun run = merged({read_back(shard_of(3, 3)), read_back(shard_of(1, 3)), read_back(shard_of(2, 3))});
  EXPECT_EQ(run.results, whole.results);
  EXPECT_EQ(run.seconds, 4.5);
  EXPECT_EQ(merged({whole}).results, whole.results);
}

TEST(UnitParts, NameWhatMakesNoWhole) {
  const auto error = [](const std::vector<UnitRun>& parts) { return error_of([&] { merged(parts); }); };
  EXPECT_EQ(error({shard_of(1, 3), shard_of(3, 3)}), "part 2/3 is missing");
  EXPECT_EQ(error({shard_of(1, 3)}), "parts 2/3, 3/3 are missing");
  EXPECT_EQ(error({shard_of(1, 2), shard_of(1, 2)}), "'part-1' and 'part-1' are both part 1/2; one of them is enough");
  UnitRun started = shard_of(2, 2);
  started.results.erase(3);
  EXPECT_TRUE(started.partial());
  EXPECT_THAT(error({shard_of(1, 2), started}), HasSubstr("'part-2' is not finished: it has 3 of 4 units"));
  UnitRun other = shard_of(2, 2);
  other.settings = "[sample]\nseed = 1\nsteps = 5\n";
  EXPECT_EQ(error({shard_of(1, 2), other}),
            "'part-2' is part of another run than 'part-1': it has steps = 5, there it is steps = 4");
  other = shard_of(2, 2);
  other.shapes[0].points(0, 0) = 0.2;
  EXPECT_THAT(error({shard_of(1, 2), other}), HasSubstr("its shapes are others"));
  other = shard_of(2, 2);
  other.facts = {{"models", {1, 3}}};
  EXPECT_THAT(error({shard_of(1, 2), other}), HasSubstr("its facts are others"));
  EXPECT_THAT(error({shard_of(1, 2), shard_of(2, 3)}), HasSubstr("it has shards 3, there it is 2"));
}

TEST(UnitParts, GoOnWithTheirOwnResults) {
  UnitRun run = shard_of(1, 2);
  run.results.clear();
  resume_units(run, read_back(shard_of(1, 2)), "file");
  EXPECT_EQ(run.results, shard_of(1, 2).results);
  EXPECT_EQ(error_of([&] { resume_units(run, shard_of(2, 2), "file"); }), "'file' is part 2 of 2, and this is part 1");
  UnitRun other = shard_of(1, 2);
  other.settings = "[sample]\nseed = 2\n";
  EXPECT_EQ(error_of([&] { resume_units(run, other, "file"); }),
            "'file' is of another run than this: it has seed = 2, here it is seed = 1");
}

TEST(UnitParts, ThatAreDamagedAreRefused) {
  const std::string bytes = unit_part(shard_of(1, 2));
  for (std::size_t length = 0; length < bytes.size(); length += 7)
    EXPECT_THROW(read_unit_part(bytes.substr(0, length), "file"), InputError) << length;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ 0x15);
    EXPECT_THROW(read_unit_part(changed, "file"), InputError) << at;
    if (at + 4 >= bytes.size()) continue;
    try {  // of somebody who knows of the checksum
      const UnitRun run = read_unit_part(sealed(changed.substr(0, bytes.size() - 4)), "file");
      EXPECT_LE(run.results.size(), run.own_units().size());
    } catch (const InputError&) {
      // what else there is to say of it
    }
  }
  EXPECT_THROW(read_unit_part(sealed(std::string(100000, '\x81')), "file"), InputError);
  UnitRun foreign = shard_of(1, 2);
  foreign.results[1] = 0;
  EXPECT_THROW(read_back(foreign), InputError) << "a unit of another shard";
}

}  // namespace
}  // namespace pulson::records
