// Options that all verbs have that read landmarks, standard input, and what keeps the files of a folder whole.

#include <csignal>
#include <string>

#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/resource.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

class ReadingProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.tps", "LM=3\n0 0\n4 0\n0 4\nCURVES=1\nPOINTS=3\n1 1\n2 1\n4 1\nSCALE=0.5\nID=a\n");
    write("b.tps", "LM=3\n0 0\n5 0\n0 4\nCURVES=1\nPOINTS=2\n1 1.5\n4 1.5\nSCALE=0.5\nID=b\n");
    write("he.csv", "id,he_col,he_row,label\n1,1,2,tip\n2,3,4,eye\n3,5,7,fin\n");
    write("turns.txt", "1\n2\n3\n4\n5\n7\n");
  }

  static ProgramRun done(const std::string& line) {
    ProgramRun result = run(words(line));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result;
  }

  static void expect_refused(const std::string& line, const std::string& message) {
    const ProgramRun result = run(words(line));
    EXPECT_EQ(result.exit_code, 2) << line;
    EXPECT_EQ(result.err, "pulson: " + message + "\n");
  }

  /// Runs with the text of a file on standard input.
  static ProgramRun run_with_input(const std::string& file, const std::string& line) {
    const int before = ::dup(STDIN_FILENO);
    const int given = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    ::dup2(given, STDIN_FILENO);
    ProgramRun result = run(words(line));
    ::dup2(before, STDIN_FILENO);
    ::close(before);
    ::close(given);
    return result;
  }
};

TEST_F(ReadingProgram, TakesColumnsAndTurns) {
  done("convert he.csv out.json --columns x=he_col,y=he_row,name=label");
  const Landmarks shape = formats::read_landmarks("out.json");
  EXPECT_EQ(shape.points, (Points(2, 3) << 1, 3, 5, 2, 4, 7).finished());
  EXPECT_THAT(shape.labels, ElementsAre("tip", "eye", "fin"));
  done("convert turns.txt turned.csv --dim 2");
  EXPECT_EQ(formats::read_landmarks("turned.csv").points, shape.points);
  expect_refused("info he.csv --columns x=he_x,y=he_row",
                 "he.csv:1: no column 'he_x'; the columns are 'id', 'he_col', 'he_row', 'label'");
  expect_refused("info he.csv --columns he_col,he_row",
                 "--columns: 'he_col' is not of the form x=COLUMN; valid: x, y, z, name, specimen, group, absent");
  expect_refused("info he.csv --columns nam=label",
                 "--columns: 'nam' is not the name of a kind of column; did you mean 'name'; valid: x, y, z, name, "
                 "specimen, group, absent");
  expect_refused("info turns.txt --dim 4", "--dim is 4; it must be 2 or 3");
}

TEST_F(ReadingProgram, LeavesOutWhatIsAbsent) {
  write("a.csv", "name,x,y\na,0,0\nb,4,0\nc,0,4\nd,5,5\n");
  write("b.csv", "name,x,y\na,0,0\nb,5,0\nc,9999,9999\nd,5,6\n");
  write("lacks.csv", "specimen,bone\na,\nb,c\n");
  EXPECT_THAT(done("info b.csv --missing 9999,zero").out, HasSubstr("missing     2 in 1 shape"));
  EXPECT_THAT(done("info b.csv --missing absent:9999").out, HasSubstr("absent      1 in 1 shape"));
  for (const std::string marks : {"--missing absent:9999", "--missing 9999 --absent lacks.csv"}) {
    done("register a.csv b.csv --sigma 1 --no-picture -o out " + marks);
    EXPECT_EQ(formats::read_landmarks("out/registration.json#2").count(), 3) << marks;
  }
  expect_refused("info b.csv --absent lacks.csv:bone",
                 "lacks.csv:3: landmark 'c' is absent from b.csv, which has coordinates of it; where these are the "
                 "mark of a missing one, --missing names it");
}

TEST_F(ReadingProgram, TakesACurveAndAScale) {
  done("convert a.tps out.csv --landmarks 3,1 --curves 2 --scale apply");
  EXPECT_EQ(
      contents("out.csv"),
      "# frame: y=up unit=0.5\nx,y,group\n0,2,landmarks\n0,0,landmarks\n0.5,0.5,\"curve 1\"\n2,0.5,\"curve 1\"\n");
  expect_refused("info a.tps --curves 1", "--curves is 1; it must be from 2 to 100000");
  expect_refused("info a.tps --scale 2", "--scale is '2'; it must be apply, or left out");
  expect_refused("info a.tps --landmarks 7", "a.tps has no landmark 7; they are numbered from 1 to 3");
  expect_refused(
      "info a.tps --format tsp",
      "--format: 'tsp' is not a landmark format; did you mean 'tps'; valid: npy, npz, roi, vtk, fcsv, mrk.json, "
      "labelme, menpo, coco, openpose, via, geojson, dlib, cvat, fiji, meshlab, json, tps, ibug, elastix, transformix, "
      "idav, nts, morphologika, edma, stereomorph, amira, via.csv, deeplabcut, bigwarp, cmtk, csv");
}

TEST_F(ReadingProgram, HasTheSameOptionsInEveryVerbThatReads) {
  for (const char* verb : {"register", "audit", "compare", "warp", "simulate", "ensemble", "convert", "info"}) {
    const std::string help = done(std::string(verb) + " --help-all").out;
    for (const char* option :
         {"--missing", "--format", "--columns", "--dim", "--landmarks", "--curves", "--scale", "--links", "-q,--quiet"})
      EXPECT_THAT(help, HasSubstr(option)) << verb;
  }
  for (const char* verb : {"fokker-planck", "reproduce"})
    EXPECT_THAT(done(std::string(verb) + " --help-all").out, HasSubstr("-q,--quiet"));
  done("simulate --shape a.tps --landmarks 1-2 --curves 3 --time 0.1 --no-picture -q -o s");
  const ProgramRun registered =
      run(words("register a.tps b.tps --landmarks 1-2 --curves 3 --scale apply --no-picture -q -o r"));
  EXPECT_EQ(registered.out, "");
  EXPECT_EQ(registered.err, "");
  EXPECT_EQ(read_json("r/registration.json")["source"].size(), 5U);
  const std::string before = contents("a.tps");
  done("warp r a.tps -o w.csv --landmarks 2 --scale apply -q");
  EXPECT_EQ(formats::read_landmarks("w.csv").count(), 1);
  EXPECT_EQ(contents("a.tps"), before);
}

TEST_F(ReadingProgram, ReadsStandardInput) {
  ProgramRun result = run_with_input("a.tps", "info -");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("-: tps with 1 shape\n"));
  result = run_with_input("turns.txt", "convert - out.csv --format csv --dim 2");
  EXPECT_EQ(result.out, "wrote out.csv: 1 shape, csv\n");
  EXPECT_EQ(formats::read_landmarks("out.csv").count(), 3);
  write("two.tps", contents("a.tps") + contents("b.tps"));
  result = run_with_input("two.tps", "register /dev/stdin#1 /dev/stdin#id=b --no-picture -q -o out");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  result = run_with_input("two.tps", "simulate --shape - -o out");
  EXPECT_EQ(result.err, "pulson: /dev/stdin has 2 shapes; choose one as /dev/stdin#1 or /dev/stdin#id=a\n");
  result = run_with_input("/dev/null", "info -");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err, "pulson: standard input is empty\n");
  write("bad.tps", "LM=2\n1 2\n");
  result = run_with_input("bad.tps", "info -");
  EXPECT_EQ(result.err,
            "pulson: standard input:1: shape 1 says 'LM=2' but has 1 line of coordinates before the file ends\n");
}

TEST_F(ReadingProgram, InfoIsQuietOnRequest) {
  EXPECT_THAT(done("info a.tps").out, HasSubstr("note: "));
  EXPECT_THAT(done("info a.tps -q").out, Not(HasSubstr("note: ")));
}

// ---- folders

using OutputFolder = ReadingProgram;

/// While there is one, no file may be larger, as on a full disk.
class LargestFile {
 public:
  explicit LargestFile(rlim_t bytes) : on_signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  LargestFile(const LargestFile&) = delete;
  LargestFile& operator=(const LargestFile&) = delete;
  ~LargestFile() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, on_signal_);
  }

 private:
  rlimit before_{};
  void (*on_signal_)(int);
};

TEST_F(OutputFolder, HoldsAllNumbersOrNoneWhereTheyDoNotFit) {
  done("register a.tps b.tps --no-picture -o out");
  const auto before = all_files();
  const auto run_with = [](rlim_t bytes, const std::string& folder) {
    const LargestFile largest(bytes);
    return run(words("register a.tps b.tps --steps 3 --no-picture -o " + folder));
  };
  const ProgramRun again = run_with(500, "out"),
                   first = run_with(500, "new");  // room for residuals.csv, not for the record
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("pulson: cannot write 'out/"));
  EXPECT_THAT(again.err, EndsWith(": File too large\n"));
  EXPECT_THAT(changed_since(before), IsEmpty());
  EXPECT_EQ(first.exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists("new"));
  const ProgramRun without_page = run_with(5000, "out");
  EXPECT_EQ(without_page.exit_code, 0);
  EXPECT_THAT(without_page.err,
              HasSubstr("warning: the page report.html was not made: cannot write 'out/report.html'"));
  EXPECT_EQ(read_json("out/registration.json")["steps"], 3);
  EXPECT_FALSE(std::filesystem::exists("out/report.html")) << "that of other numbers";
}

TEST_F(OutputFolder, HasOneWriter) {
  std::filesystem::create_directory("out");
  write("out/.pulson.lock", "4711\n");
  const int lock = ::open("out/.pulson.lock", O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::flock(lock, LOCK_EX), 0);
  const std::string fit = "register a.tps b.tps --no-picture -q -o out";
  const ProgramRun refused = run(words(fit));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, EndsWith("pulson: another pulson (process 4711) writes into 'out' at present; wait until it "
                                    "ends, or choose another folder\n"));
  EXPECT_THAT(names_in("out"), ElementsAre(".pulson.lock"));
  ::close(lock);  // as that process ends
  done(fit);
  EXPECT_THAT(names_in("out"), ElementsAre("registration.json", "report.html", "residuals.csv", "trajectory.csv"));
}

}  // namespace
}  // namespace pulson
