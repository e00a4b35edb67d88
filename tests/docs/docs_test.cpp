// Runs the commands of README.md and docs/: each ends as the page says, and prints what the page shows.

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include <gmock/gmock.h>

#include "docs_page.hpp"
#include "program.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(DocsPage, HasTheCommandsOfItsConsoleBlocks) {
  const Page page = read_page(
      "Text\n```console\n$ pulson info a.csv\nrms 1\n\n$ pulson warp a \\\n    b\n```\n<!-- in tests: 50 as 5; exit 3 "
      "-->\n"
      "```console\n$ pulson ensemble --samples 50\nshown\n```\n```cpp\npulson::x;\n```\n");
  ASSERT_EQ(page.commands.size(), 3U);
  EXPECT_EQ(page.commands[0].command, "pulson info a.csv");
  EXPECT_EQ(page.commands[0].line, 3U);
  EXPECT_THAT(page.commands[0].shown, ElementsAre("rms 1"));
  EXPECT_EQ(page.commands[1].command, "pulson warp a \\\n    b");
  EXPECT_THAT(page.commands[1].shown, IsEmpty());
  EXPECT_EQ(page.commands[2].command, "pulson ensemble --samples 5");
  EXPECT_TRUE(page.commands[2].shortened);
  EXPECT_EQ(page.commands[2].exit_code, 3);
  EXPECT_THAT(page.strays, IsEmpty());
}

TEST(DocsPage, NamesThePicturesThatItsCommandsWrite) {
  const std::string text =
      "<!-- in tests: 50 as 5 -->\n```console\n$ pulson a 50\n$ pulson b\n```\n\n<!-- images: a.png = a/b.png, c.gif = "
      "c.gif "
      "-->\n";
  const Page page = read_page(text);
  ASSERT_EQ(page.images.size(), 2U);
  EXPECT_EQ(page.images[0].name + page.images[0].file, "a.pnga/b.png");
  EXPECT_EQ(page.images[1].command, 1U);
  EXPECT_EQ(page.commands[0].command, "pulson a 5");
  EXPECT_EQ(read_page(text, true).commands[0].command, "pulson a 50");
  EXPECT_EQ(read_page(text + "<!-- in tests: 50 as 5 -->\n```console\n$ pulson c 50\n```\n", true).commands[2].command,
            "pulson c 5")
      << "which no picture needs";
}

TEST(DocsPage, HasTheFilesThatItsCommandsUse) {
  const Page page = read_page(
      "<!-- file: a.py -->\n```python\nx = 1\n    pulson = x\n```\n```python\ny\n```\n```console\n$ python3 "
      "a.py\n```\n");
  EXPECT_THAT(page.files, ElementsAre(std::pair("a.py", "x = 1\n    pulson = x\n")));
  EXPECT_EQ(page.commands.size(), 1U);
}

TEST(DocsPage, AnErrorThatIsShownMeansExitCodeTwo) {
  EXPECT_EQ(read_page("```console\n$ pulson x\npulson: unknown verb\n```\n").commands.at(0).exit_code, 2);
}

TEST(DocsPage, FindsCommandsThatNoTestRuns) {
  EXPECT_THAT(
      read_page("```\npulson info kernels\n```\n\n    $ build/bin/pulson register a b\n\nso pulson info is text\n")
          .strays,
      ElementsAre(2U, 5U));
}

TEST(DocsPage, LinesAgreeUpToTwoPercent) {
  EXPECT_TRUE(lines_agree("rms        0.1234 (was 49.2)", "rms  0.1235 (was 49.2)"));
  EXPECT_FALSE(lines_agree("rms 0.1234 (was 49.2)", "rms 0.1334 (was 49.2)"));
  EXPECT_FALSE(lines_agree("rms 0.1234", "rmse 0.1234"));
  EXPECT_FALSE(lines_agree("rms 0.1234", "rms 0.1234 more"));
  EXPECT_TRUE(lines_agree("9 iterations in … s: the gradient …", "9 iterations in 0.01 s: the gradient vanishes"));
  EXPECT_FALSE(lines_agree("9 iterations in … s: the", "9 iterations in 0.01 s: a"));
  EXPECT_FALSE(lines_agree("1e-3", "1e-4"));
  EXPECT_TRUE(lines_agree("2.5e-15", "2.7e-15"));
  EXPECT_FALSE(lines_agree("2.5e-15", "2.7e-13"));
}

// Commands that are not run: they set up the machine, build, or measure for minutes. What they call is tested
// elsewhere.
const std::vector<std::string> kNotRun = {
    "scripts/", "cmake ", "git ",   "benchmarks/", "build/release/benchmarks/", "build/dev/benchmarks/",
    "cd ",      "sudo ",  "ctest ", "doxygen "};

std::vector<std::string> pages() {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  std::vector<std::string> names = {"README.md", "sample_shapes/README.md"};
  for (const auto& entry : std::filesystem::directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") names.push_back("docs/" + entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

class Docs : public Program, public testing::WithParamInterface<std::string> {
 protected:
  static bool has_programs(const PageCommand& command) {
    return std::all_of(command.programs.begin(), command.programs.end(), [](const std::string& name) {
      return std::system(("command -v " + name + " >/dev/null").c_str()) == 0;
    });
  }

  // Whether the real files that a command reads are here; they are linked into the folder by their names.
  static bool has_needs(const PageCommand& command) {
    for (const std::string& name : command.needs) {
      const std::filesystem::path file = data_folder() / name;
      if (!std::filesystem::exists(file)) return false;
      if (!std::filesystem::exists(file.filename())) std::filesystem::create_symlink(file, file.filename());
    }
    return true;
  }

  static bool is_run(const PageCommand& command) {
    return std::none_of(kNotRun.begin(), kNotRun.end(),
                        [&](const std::string& prefix) { return command.command.rfind(prefix, 0) == 0; }) &&
           has_programs(command) && has_needs(command);
  }

  static std::vector<std::string> lines_of(const std::string& file) {
    std::ifstream stream(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }
};

// The folder that scripts/gallery fills; empty in tests.
std::filesystem::path gallery() {
  const char* folder = std::getenv("PULSON_GALLERY");
  return folder == nullptr ? "" : folder;
}

// One shell runs a page, so that variables and files last from one command to the next.
TEST_P(Docs, CommandsDoWhatThePageShows) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  const Page page = read_page(contents((root / GetParam()).string()), !gallery().empty());
  EXPECT_THAT(page.strays, IsEmpty()) << "lines of " << GetParam()
                                      << " with a command in another block than ```console";
  std::filesystem::create_symlink(root / "sample_shapes", "sample_shapes");
  const std::string bin = std::filesystem::path(PULSON_PROGRAM).parent_path().string();
  for (const auto& [name, text] : page.files) std::ofstream(name) << text;
  std::ofstream script(".script");
  script << "PATH=" << bin << ":$PATH\npython3() { " PULSON_PYTHON " \"$@\"; }\n";
  for (const PageCommand& command : page.commands)
    if (is_run(command))
      script << "{ " << command.command << "\n} >.out_" << command.line << " 2>&1\necho $? >.code_" << command.line
             << "\n";
  script.close();
  ASSERT_EQ(std::system(gallery().empty() ? "timeout 500 sh .script" : "sh .script"), 0);
  for (const PageCommand& command : page.commands) {
    if (!is_run(command)) continue;
    SCOPED_TRACE(GetParam() + ":" + std::to_string(command.line) + ": " + command.command);
    const std::string out = ".out_" + std::to_string(command.line);
    EXPECT_THAT(lines_of(".code_" + std::to_string(command.line)), ElementsAre(std::to_string(command.exit_code)))
        << contents(out);
    if (command.shortened) continue;
    const std::vector<std::string> real = lines_of(out);
    for (const std::string& shown : command.shown)
      EXPECT_TRUE(
          std::any_of(real.begin(), real.end(), [&](const std::string& line) { return lines_agree(shown, line); }))
          << "shown:   " << shown << "\nprinted:\n"
          << contents(out);
  }
  for (const PageImage& image : page.images) {
    const PageCommand& command = page.commands[image.command];
    if (!is_run(command) || command.shortened) continue;
    EXPECT_TRUE(std::filesystem::exists(image.file)) << GetParam() << ": no command writes " << image.file;
    if (!gallery().empty())
      std::filesystem::copy_file(image.file, gallery() / image.name, std::filesystem::copy_options::overwrite_existing);
  }
}

// Every picture of docs/images is made by the commands of one page, and shown.
TEST(Gallery, HasACommandForEveryPicture) {
  const std::filesystem::path root = PULSON_SOURCE_DIR;
  std::set<std::string> made, there;
  std::string text;
  for (const std::string& name : pages()) {
    std::ifstream stream(root / name);
    const std::string page{std::istreambuf_iterator<char>(stream), {}};
    text += page;
    for (const PageImage& image : read_page(page).images) EXPECT_TRUE(made.insert(image.name).second) << image.name;
  }
  for (const auto& entry : std::filesystem::directory_iterator(root / "docs/images")) {
    there.insert(entry.path().filename().string());
    EXPECT_NE(text.find("images/" + entry.path().filename().string() + ")"), std::string::npos) << entry.path();
  }
  EXPECT_EQ(made, there);
}

INSTANTIATE_TEST_SUITE_P(Pages, Docs, testing::ValuesIn(pages()), [](const auto& page) {
  std::string name = page.param;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
});

}  // namespace
}  // namespace pulson
