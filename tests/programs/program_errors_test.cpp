// Wrong input and options: exit code 2, one line that says what is wrong and what would be right, and nothing written.

#include <ostream>
#include <regex>
#include <utility>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

class WrongInput : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
    write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
    write("two.csv", "x,y\n0,0\n1,0\n");
    write("three_d.csv", "x,y,z\n0,0,0\n1,0,1\n0,1,2\n");
    write("nan.csv", "x,y\n0,0\n1,nan\n0,1\n");
    write("nan_names.csv", "label,x,y\nnose,0,0\ntail,1,0\nfin,NA,NA\n");
    write("infinite.csv", "x,y\n0,0\n1,inf\n0,1\n");
    write("cut.vtk", "# vtk DataFile Version 3.0\ncut\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n  1   2    3\n");
    write("word.csv", "x,y\n0,0\n1,abc\n0,1\n");
    write("header.csv", "x,y\n");
    write("empty.csv", "");
    write("coincident.csv", "x,y\n0,0\n1,0\n1,0\n");
    write("coincident_names.csv", "label,x,y\nnose,0,0\ntail,1,0\nfin,1,0\n");
    write("many.tps", "LM=3\n0 0\n1 0\n0 1\nID=ann\nLM=3\n0 0\n1.1 0\n0 1.1\nID=bob\n");
    fs::create_directory("folder");
  }

  static void expect_one_line(const std::string& text) {
    EXPECT_EQ(count_lines(text), 1U) << text;
    EXPECT_THAT(text, testing::EndsWith("\n"));
    EXPECT_THAT(text, StartsWith("pulson: "));
  }

  /// @param parts what the message must hold
  static void expect_refused(const Arguments& arguments, const std::vector<std::string>& parts,
                             const ProgramSetting& setting = {}) {
    const auto before = all_files();
    const ProgramRun done = run(arguments, setting);
    EXPECT_EQ(done.exit_code, 2) << done.err;
    EXPECT_EQ(done.out, "");
    expect_one_line(done.err);
    for (const std::string& part : parts) EXPECT_THAT(done.err, HasSubstr(part));
    EXPECT_THAT(changed_since(before), IsEmpty());
  }

  static Arguments register_ab(const std::string& options) {
    return joined(words("register a.csv b.csv -o out"), words(options));
  }
};

struct WrongCommand {
  std::string name;
  std::string line;
  std::vector<std::string> parts;
};

std::ostream& operator<<(std::ostream& stream, const WrongCommand& command) { return stream << command.line; }

class WrongCommands : public WrongInput, public testing::WithParamInterface<WrongCommand> {};
class WrongOptions : public WrongInput, public testing::WithParamInterface<WrongCommand> {};

TEST_P(WrongCommands, AreRefused) { expect_refused(words(GetParam().line), GetParam().parts); }
TEST_P(WrongOptions, AreRefused) { expect_refused(register_ab(GetParam().line), GetParam().parts); }

// clang-format off
const std::vector<WrongCommand> kWrongCommands = {
    {"UnknownVerb", "regster a.csv b.csv -o out", {"unknown verb 'regster'; did you mean 'register'"}},
    {"UnknownGlobal", "--versoin", {"unknown option '--versoin'; did you mean '--version'"}},
    {"MisspeltSamples", "simulate --q 0,1 --sampels 3", {"unknown option '--sampels'; did you mean '--samples'", "pulson simulate --help"}},
    {"MisspeltWarp", "warp r.json a.png --invers -o out.png", {"unknown option '--invers'; did you mean '--inverse'"}},
    {"MisspeltExperiment", "reproduce figur1 -o out", {"unknown experiment 'figur1'; did you mean 'figure1'"}},
    {"MisspeltLabels", "warp r.json a.csv -o out.csv --labels metrix", {"unknown labels 'metrix'; did you mean 'metric'"}},
    {"MisspeltFormat", "convert a.csv b.tps --to tpss", {"'tpss'", "did you mean 'tps'; valid: "}},
    {"Repeated", "register a.csv b.csv --sigma 1 -o out --sigma 2", {"--sigma is given 2 times; it takes one value"}},
    {"MisspeltTable", "info kernals", {"'kernals'", "did you mean 'kernels'"}},
    {"RegisterAlone", "register", {"SOURCE"}},
    {"NoTarget", "register a.csv -o out", {"TARGET"}},
    {"NoFolder", "register a.csv b.csv", {"--out"}},
    {"OneFileTooMany", "warp out a.csv b.csv -o new", {"'b.csv' is one argument too many"}},
    {"InfoAlone", "info", {"WHAT"}},
    {"InfoNonsense", "info nonsense", {"'nonsense'", "kernels, noises, integrators, formats"}},
    {"InfoFolder", "info folder", {"'folder'", "a file is needed"}},
    {"InfoInfinite", "info infinite.csv", {"infinite.csv:3", "landmark 2", "must be finite"}},
    {"InfoCutVtk", "info cut.vtk", {"cut.vtk:5", "needs 6 numbers", "the file ends after 3"}},
    {"MissingSource", "register missing.csv b.csv -o out", {"'missing.csv'", "No such file"}},
    {"MissingTarget", "register a.csv missing.csv -o out", {"'missing.csv'", "No such file"}},
    {"FolderAsSource", "register folder b.csv -o out", {"'folder'", "a file is needed"}},
    {"FolderAsTarget", "register a.csv folder -o out", {"'folder'", "a file is needed"}},
    {"EmptyFile", "register empty.csv b.csv -o out", {"empty.csv is empty"}},
    {"HeaderOnly", "register header.csv b.csv -o out", {"header.csv", "no landmarks"}},
    {"UnequalNumbers", "register a.csv two.csv -o out", {"a.csv has 3", "two.csv has 2", "(outlines without correspondence: --data varifold)"}},
    {"OtherDimension", "register a.csv three_d.csv -o out", {"a.csv is 2D", "three_d.csv is 3D"}},
    {"NanSimulate", "simulate --shape nan.csv -o out", {"nan.csv: landmark 2 has a missing coordinate"}},
    {"NanSimulateName", "simulate --shape nan_names.csv -o out", {"nan_names.csv: landmark 'fin' has a missing coordinate"}},
    {"NanMomenta", "simulate --shape a.csv --momenta nan.csv -o out", {"nan.csv: landmark 2 has a missing coordinate"}},
    {"NanEnsemble", "ensemble --shape nan.csv --noise ch-sd:beta=1 --samples 10 -o out",
     {"nan.csv: landmark 2 has a missing coordinate"}},
    {"Word", "register word.csv b.csv -o out", {"word.csv:3", "'abc'", "a number is needed"}},
    {"Coincident", "register coincident.csv b.csv -o out", {"coincident.csv", "landmarks 2 and 3", "merge them with --merge-coincident, or"}},
    {"CoincidentNames", "register coincident_names.csv b.csv -o out", {"'tail' and 'fin'"}},
    {"NoiseBeyondTheLast", "register two.csv two.csv -o out --align none --noise ch-sd:beta=1,on=9", {"on=9", "2"}},
    {"SeveralShapes", "register many.tps b.csv -o out", {"2 shapes", "many.tps#1", "many.tps#id=ann"}},
    {"NumberZero", "register many.tps#0 b.csv -o out", {"2 shapes", "from 1", "#0"}},
    {"NumberBeyond", "register a.csv many.tps#99 -o out", {"2 shapes", "#99"}},
    {"NumberBeyondAll", "register a.csv many.tps#99999999999999999999999 -o out", {"2 shapes"}},
    {"NumberMissing", "register many.tps# b.csv -o out", {"many.tps", "id=NAME"}},
    {"NobodyOfThatName", "register many.tps#id=nobody b.csv -o out", {"'nobody'", "ann, bob"}},
    {"NearlyThatName", "register many.tps#id=bobb b.csv -o out", {"'bobb'", "did you mean 'bob'"}},
    {"OutIsAFile", "register a.csv b.csv -o two.csv", {"'two.csv'", "it is a file"}},
    {"OutIsInAFile", "register a.csv b.csv -o two.csv/out", {"'two.csv/out'"}},
    {"OutNowhere", "register a.csv b.csv -o /dev/null/out", {"'/dev/null/out'"}},
};

const std::vector<WrongCommand> kWrongOptions = {
    {"AlphaZero", "--kernel gaussian:alpha=0", {"kernel 'gaussian'", "alpha is 0", "greater than 0"}},
    {"AlphaNegative", "--kernel gaussian:alpha=-1", {"alpha is -1", "greater than 0"}},
    {"AlphaNan", "--kernel gaussian:alpha=nan", {"alpha is 'nan'", "finite"}},
    {"AlphaWord", "--kernel gaussian:alpha=wide", {"alpha is 'wide'", "a number is needed"}},
    {"AlphaTwice", "--kernel gaussian:alpha=1,alpha=2", {"alpha is given twice"}},
    {"AlphaMisspelt", "--kernel gaussian:alpa=1", {"'alpa'", "alpha"}},
    {"KernelMisspelt", "--kernel gausian:alpha=1", {"unknown kernel 'gausian'", "did you mean 'gaussian'", "peakon"}},
    {"KernelUnknown", "--kernel foo", {"unknown kernel 'foo'", "gaussian", "peakon"}},
    {"ParameterMisspelt", "--kernel gaussian:alpa=1", {"no parameter 'alpa'; did you mean 'alpha'"}},
    {"NoiseMisspelt", "--noise ch-ds:beta=1", {"unknown noise 'ch-ds'", "did you mean 'ch-sd'", "none"}},
    {"NoiseUnknown", "--noise zzzzz", {"unknown noise 'zzzzz'", "none", "ch-sd"}},
    {"BetaMissing", "--noise ch-sd", {"'ch-sd' needs beta", "ch-sd:beta=1"}},
    {"BetaZero", "--noise ch-sd:beta=0", {"beta is 0", "greater than 0"}},
    {"OnZero", "--noise ch-sd:beta=1,on=0", {"on is '0'", "from 1"}},
    {"OnTwice", "--noise ch-sd:beta=1,on=2/2", {"on is '2/2'", "twice"}},
    {"Mode", "--mode foo", {"unknown mode 'foo'", "deterministic, metamorphosis, map"}},
    {"ModeWithoutValue", "--mode=", {"--mode"}},
    {"ModeWithoutNoise", "--mode map", {"mode map", "as in --noise ch-sd:beta=1"}},
    {"Align", "--align foo", {"unknown alignment 'foo'", "none, translation, rigid, similarity"}},
    {"Solver", "--solver foo", {"unknown solver 'foo'", "gauss-newton", "lbfgs", "auto"}},
    {"Integrator", "--integrator foo", {"unknown integrator 'foo'", "variational"}},
    {"StepsZero", "--steps 0", {"--steps is 0", "from 1"}},
    {"StepsWord", "--steps many", {"--steps", "many"}},
    {"StepsFraction", "--steps 1.5", {"--steps", "1.5"}},
    {"StepsTwice", "--steps 3 --steps 4", {"--steps"}},
    {"StepsAndDt", "--steps 10 --dt 0.1", {"--steps", "--dt"}},
    {"DtZero", "--dt 0", {"--dt is 0", "greater than 0"}},
    {"DtNan", "--dt nan", {"--dt is nan"}},
    {"DtTiny", "--dt 1e-12", {"--dt is 1e-12", "steps"}},
    {"SigmaZero", "--sigma 0", {"sigma is 0", "greater than 0"}},
    {"SigmaNan", "--sigma nan", {"sigma is nan"}},
    {"SigmaNegative", "--sigma=-1%", {"--sigma is -1%", "greater than 0"}},
    {"LambdaNegative", "--lambda -1", {"lambda is -1", "greater than 0"}},
    {"LambdaWord", "--lambda heavy", {"--lambda is 'heavy'", "a number is needed"}},
    {"LambdaInfinite", "--lambda inf", {"lambda is inf", "finite"}},
    {"TimeNan", "--time nan", {"--time is nan"}},
    {"TimeInfinite", "--time inf", {"--time is inf", "finite"}},
    {"ThreadsNegative", "--threads -1", {"--threads is -1"}},
    {"ToleranceZero", "--tolerance 0", {"--tolerance is 0"}},
    {"IterationsNegative", "--max-iterations -1", {"--max-iterations is -1"}},
    {"UnknownOption", "--nosuch", {"unknown option '--nosuch' (see pulson register --help)"}},
    {"OptionMisspelt", "--kernal gaussian:alpha=1", {"unknown option '--kernal'; did you mean '--kernel'"}},
    {"OptionMisspeltWithValue", "--kernal=gaussian:alpha=1", {"unknown option '--kernal'; did you mean '--kernel'"}},
    {"OneDash", "-kernel gaussian:alpha=1", {"unknown option '-kernel'; did you mean '--kernel'"}},
    {"OneDashOfShort", "-out out2", {"unknown option '-out'; did you mean '--out'"}},
    {"ModeMisspelt", "--mode mpa", {"unknown mode 'mpa'; did you mean 'map'"}},
    {"AlignMisspelt", "--align rigdi", {"unknown alignment 'rigdi'; did you mean 'rigid'"}},
    {"SolverMisspelt", "--solver lbgfs", {"unknown solver 'lbgfs'; did you mean 'lbfgs'"}},
    {"DataMisspelt", "--data varifolds", {"unknown data 'varifolds'; did you mean 'varifold'"}},
    {"EndsMisspelt", "--curve-ends opne", {"unknown ends 'opne'; did you mean 'open'"}},
    {"IntegratorMisspelt", "--integrator huen", {"unknown integrator 'huen'; did you mean 'heun'"}},
    {"OptionWithoutValue", "--kernel", {"--kernel"}},
    {"JsonWithoutFolder", "--no-picture --json nowhere/x.json", {"'nowhere/x.json'", "no folder 'nowhere'"}},
    {"JsonIsAFolder", "--no-picture --json folder", {"'folder'", "it is a folder"}},
};
// clang-format on

INSTANTIATE_TEST_SUITE_P(Command, WrongCommands, testing::ValuesIn(kWrongCommands), kName);
INSTANTIATE_TEST_SUITE_P(Option, WrongOptions, testing::ValuesIn(kWrongOptions), kName);

TEST_F(WrongInput, NoArgumentsGetExamples) {
  const ProgramRun done = run({});
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_EQ(done.out, "");
  EXPECT_THAT(done.err, HasSubstr("pulson register a.csv b.csv -o out"));
  EXPECT_THAT(done.err, HasSubstr("pulson --help"));
  EXPECT_LE(count_lines(done.err), 10U);
}

// Values that look like options are values.
TEST_F(WrongInput, NumbersBelowZeroAreNoOptions) {
  EXPECT_EQ(run(words("simulate --q -1,1 --p -1,-.5 --time 1 --no-picture -o out")).exit_code, 0);
  EXPECT_EQ(run(words("register a.csv b.csv -oout2 --no-picture -q")).exit_code, 0);
  write("-odd.csv", "x,y\n0,0\n1,0\n0,1\n");
  EXPECT_EQ(run(words("info -- -odd.csv")).exit_code, 0);
}

// What is missing is reported and is not an error.
TEST_F(WrongInput, InfoCountsMissingLandmarks) {
  write("all.csv", "NA,NA\nNA,NA\n");
  EXPECT_THAT(run(words("info nan.csv")).out, HasSubstr("3 landmarks in 2D, x 0 to 0 y 0 to 1, 1 missing\n"));
  EXPECT_THAT(run(words("info all.csv")).out, HasSubstr("2 landmarks in 2D, 2 missing\n"));
  EXPECT_THAT(run(words("info a.csv")).out, Not(HasSubstr("missing")));
}

// It may be why the shapes do not fit.
TEST_F(WrongInput, ComesWithTheNotesOnItsFiles) {
  write("turns.csv", "1\n50\n2\n51\n1\n52\n3\n53\n");
  write("others.csv", "1\n50\n2\n51\n1.5\n52\n3\n54\n");
  const ProgramRun done = run(words("register turns.csv others.csv -o out"));
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err,
              AllOf(HasSubstr("note: turns.csv: one column without a header"), HasSubstr("if it holds x and y in turn"),
                    HasSubstr("landmarks 1 and 5 are at the same position")));
}

TEST_F(WrongInput, LeavesEarlierResultsAlone) {
  ASSERT_EQ(run(register_ab("")).exit_code, 0);
  expect_refused(register_ab("--sigma 0"), {"sigma"});
  expect_refused(words("register coincident.csv b.csv -o out"), {"landmarks 2 and 3"});
}

// What the numbers did is told like wrong input, in the words of the command line.
TEST_F(WrongInput, NumericalFailuresAreOneLine) {
  const std::string strong = " --noise p-sd:beta=1000,fields=cos --steps 2 --no-picture -q";
  expect_refused(words("register a.csv b.csv -o out --mode pathwise" + strong),
                 {"landmarks at rest have no path", "(use more --steps or a smaller amplitude)"});
}

TEST_F(WrongInput, OddTextStaysOneLine) {
  expect_refused({"register", "no\nsuch\rfile.csv", "b.csv", "-o", "out"}, {"cannot read"});
  expect_refused(joined(register_ab("--kernel"), {"x\ny"}), {"holds a control character"});
  expect_refused({"register", "", "b.csv", "-o", "out"}, {"argument 1 of register is empty"});
  expect_refused(joined(register_ab("--kernel"), {""}), {"--kernel is empty"});
  expect_refused(joined(register_ab("--mode"), {""}), {"--mode is empty"});
  expect_refused({"register", "a.csv", "b.csv", "-o", ""}, {"-o is empty"});
}

TEST_F(WrongInput, FoldersThatForbidWriting) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::permissions("folder", fs::perms::owner_read | fs::perms::owner_exec);
  expect_refused(words("register a.csv b.csv -o folder"), {"'folder'", "Permission denied"});
  expect_refused(words("register a.csv b.csv -o folder/out"), {"'folder/out'", "Permission denied"});
  fs::permissions("folder", fs::perms::owner_all);
  fs::permissions("a.csv", fs::perms::none);
  expect_refused(register_ab(""), {"'a.csv'", "Permission denied"});
}

// One result that cannot be written must not leave the others behind.
TEST_F(WrongInput, ResultsAreWrittenAllOrNone) {
  for (const std::string name : {"registration.json", "trajectory.csv", "report.html", "registration.png"}) {
    fs::create_directories("out/" + name);
    expect_refused(register_ab(""), {"'out/" + name + "'"});
    fs::remove_all("out");
  }
}

TEST_F(WrongInput, FullDiskBehindTheRecord) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const ProgramRun done = run(register_ab("--no-picture --json /dev/full"));
  EXPECT_EQ(done.exit_code, 2);
  expect_one_line(done.err);
  EXPECT_THAT(done.err, HasSubstr("/dev/full"));
  EXPECT_THAT(names_in("out"),
              AnyOf(IsEmpty(), ElementsAre("registration.json", "report.html", "residuals.csv", "trajectory.csv")));
}

class ExtremeNumbers : public WrongInput, public testing::WithParamInterface<WrongCommand> {};

// It may succeed, give up or refuse, but it must not crash, hang, or call it an internal error.
TEST_P(ExtremeNumbers, EndInOrder) {
  write("huge.csv", "x,y\n0,0\n1e308,0\n0,1e308\n");
  write("large.csv", "x,y\n0,0\n1e150,0\n0,1e150\n");
  write("tiny.csv", "x,y\n0,0\n1e-308,0\n0,1e-308\n");
  const ProgramRun done = run(joined(words(GetParam().line), words("-o out --no-picture")), {.limit = 5});
  ASSERT_THAT(done.exit_code, AnyOf(0, 2, 3)) << done.err;
  if (done.exit_code == 2) {
    expect_one_line(done.err);
    EXPECT_THAT(names_in("out"), IsEmpty());
    EXPECT_THAT(done.err, Not(HasSubstr("at the same position"))) << "they are not";
  } else {
    EXPECT_TRUE(read_json("out/registration.json").is_object());
    EXPECT_TRUE(read_json("out/registration.json")["rms"].is_number());
  }
}

// clang-format off
INSTANTIATE_TEST_SUITE_P(Extreme, ExtremeNumbers, testing::Values(
    WrongCommand{"SigmaSmall", "register a.csv b.csv --sigma 1e-300", {}},
    WrongCommand{"SigmaLarge", "register a.csv b.csv --sigma 1e300", {}},
    WrongCommand{"LambdaLarge", "register a.csv b.csv --lambda 1e300", {}},
    WrongCommand{"AlphaSmall", "register a.csv b.csv --kernel gaussian:alpha=1e-300", {}},
    WrongCommand{"AlphaLarge", "register a.csv b.csv --kernel gaussian:alpha=1e300", {}},
    WrongCommand{"PeakonSmall", "register a.csv b.csv --kernel peakon:alpha=1e-300", {}},
    WrongCommand{"BetaSmall", "register a.csv b.csv --noise ch-sd:beta=1e-300", {}},
    WrongCommand{"BetaLarge", "register a.csv b.csv --noise ch-sd:beta=1e300", {}},
    WrongCommand{"TimeSmall", "register a.csv b.csv --time 1e-300", {}},
    WrongCommand{"TimeLarge", "register a.csv b.csv --time 1e300", {}},
    WrongCommand{"SourceHuge", "register huge.csv b.csv", {}},
    WrongCommand{"TargetHuge", "register a.csv huge.csv", {}},
    WrongCommand{"SourceLarge", "register large.csv b.csv", {}},
    WrongCommand{"TargetLarge", "register a.csv large.csv", {}},
    WrongCommand{"SourceTiny", "register tiny.csv b.csv", {}},
    WrongCommand{"NothingToDo", "register a.csv a.csv", {}},
    WrongCommand{"ManyThreads", "register a.csv b.csv --threads 1000000", {}}), kName);
// clang-format on

// ---- the library's messages

class LibraryMessages : public InTemporaryFolder {
 protected:
  // All string literals of the library, by file.
  static std::vector<std::pair<std::string, std::string>> library_literals() {
    std::vector<std::pair<std::string, std::string>> literals;
    static const std::regex kLiteral(R"re("((?:[^"\\\n]|\\.)*)")re");
    for (const char* folder : {"include", "src"})
      for (const auto& entry : fs::recursive_directory_iterator(fs::path(PULSON_SOURCE_DIR) / folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".cpp" && extension != ".hpp") continue;
        const std::string text = contents(entry.path().string());
        for (std::sregex_iterator at(text.begin(), text.end(), kLiteral), end; at != end; ++at)
          literals.emplace_back(entry.path().filename().string(), (*at)[1].str());
      }
    return literals;
  }
};

// Host programs have no such options; ours puts them in place of the settings that the library names.
TEST_F(LibraryMessages, NameSettingsAndNoOptionsOfTheCommandLine) {
  const std::string known = contents((fs::path(PULSON_SOURCE_DIR) / "apps/shell/options.cpp").string());
  ASSERT_NE(known, "");
  static const std::regex kOption("(^|[^-a-z(]|[^r][(])--[a-z]{2}");
  static const std::regex kSetting("`([^`]*?)( = [^`]*)?`");
  const std::string described = "landmarks of menpo: ";  // of a format, whose own words are in backticks
  int settings = 0;
  for (const auto& [file, text] : library_literals()) {
    EXPECT_FALSE(std::regex_search(text, kOption)) << file << ": " << text;
    if (text.starts_with(described)) continue;
    for (std::sregex_iterator at(text.begin(), text.end(), kSetting), end; at != end; ++at, ++settings)
      EXPECT_TRUE(known.find('"' + (*at)[1].str() + '"') != std::string::npos ||
                  known.find('"' + (*at)[1].str() + (*at)[2].str() + '"') != std::string::npos)
          << file << ": " << text;
  }
  EXPECT_GT(settings, 10);
}

}  // namespace
}  // namespace pulson
