// Names of specimens and landmarks through the program: exact in every table and record, safe in folders.

#include <fstream>

#include <gmock/gmock.h>

#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAreArray;
using Strings = std::vector<std::string>;

class Names : public Program {
 protected:
  /// A table of small shapes with these names, each a little different.
  static void write_shapes(const std::string& file, const Strings& names) {
    text::CsvTable table{"specimen", "landmark", "x", "y"};
    for (std::size_t i = 0; i < names.size(); ++i)
      for (std::size_t a = 0; a < 4; ++a) {
        table.text(names[i]).word(std::string(1, "pqrs"[a]));
        table.numbers(static_cast<double>(a / 2) + 0.01 * static_cast<double>(i * i % 7 + a * i % 5),
                      static_cast<double>(a % 2) + 0.01 * static_cast<double>(i % 3));
        table.end_row();
      }
    std::ofstream(file, std::ios::binary) << std::move(table).take();
  }

  /// The column of a table, without its header.
  static Strings column(const std::string& file, const std::string& name) {
    const std::vector<formats::CsvRecord> rows = formats::csv_records(file, contents(file));
    Strings cells;
    for (std::size_t c = 0; c < rows.front().fields.size(); ++c)
      if (rows.front().name(c) == name)
        for (std::size_t r = 1; r < rows.size(); ++r) cells.push_back(rows[r].name(c));
    return cells;
  }

  static Strings folders_in(const std::string& folder) {
    Strings names;
    for (const std::string& name : names_in(folder))
      if (std::filesystem::is_directory(folder + "/" + name)) names.push_back(name);
    return names;
  }
};

const Strings kNames = {"Acer rubrum 1",
                        "wolf, grey",
                        "it's \"one\"",
                        "a\nb",
                        "a\r\nb",
                        " a",
                        "a ",
                        "007",
                        "#3",
                        "id=x",
                        "=1+1",
                        "@x",
                        "-1",
                        "+",
                        "NA",
                        "ä/ö",
                        "../x",
                        "CON",
                        "nul.txt",
                        ".hidden",
                        "-o",
                        "a_b",
                        "a b",
                        "A B",
                        "x\x1b[31my",
                        "trailing.",
                        "cohort.csv",
                        "register.partial",
                        "\t=x",
                        "<b>&'"};

TEST_F(Names, AreExactInTheTableOfACohortAndSafeInItsFolders) {
  Strings names = kNames;
  names.push_back(std::string(150, 'n'));
  names.push_back(std::string(150, 'n') + "2");
  write_shapes("shapes.csv", names);
  const ProgramRun done = run(words("register shapes.csv -q --steps 2 --max-iterations 3 -o out"));
  ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  EXPECT_EQ(column("out/cohort.csv", "specimen"), names);
  const Strings folders = column("out/cohort.csv", "folder");
  EXPECT_THAT(folders_in("out"), UnorderedElementsAreArray(folders));
  const nlohmann::json record = read_json("out/cohort.json");
  std::set<std::string> lower;
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(record["specimens"][i]["name"], names[i]);
    EXPECT_EQ(record["specimens"][i]["folder"], folders[i]);
    EXPECT_EQ(record["specimens"][i]["record"], folders[i] + "/registration.json");
    EXPECT_EQ(read_json("out/" + folders[i] + "/registration.json")["target_shape"]["name"], names[i]);
    EXPECT_LE(folders[i].size(), 110U);
    EXPECT_EQ(folders[i].find_first_of("/\\:*?\"<>| \n\r\t\x1b'"), std::string::npos) << folders[i];
    EXPECT_EQ(std::string(".-").find(folders[i].front()), std::string::npos) << folders[i];
    EXPECT_NE(folders[i].back(), '.');
    EXPECT_TRUE(lower.insert(text::to_lower(folders[i])).second) << folders[i];
  }
  EXPECT_THAT(folders, Not(testing::Contains("CON")));
  EXPECT_THAT(folders, Not(testing::Contains("nul.txt")));
  EXPECT_THAT(contents("out/report.html"), AllOf(HasSubstr("Acer rubrum 1"), HasSubstr("&lt;b&gt;&amp;"),
                                                 Not(HasSubstr("<b>&")), Not(HasSubstr("Acer_rubrum_1"))));
}

TEST_F(Names, OfTpsAreJoinedWithOnesOwnTable) {
  std::string tps;
  for (int i = 1; i <= 5; ++i)
    tps += "LM=4\n0 0\n1 0.0" + std::to_string(i * i) + "\n0.0" + std::to_string(i) + " 1\n1." + std::to_string(i) +
           " 1\nID=Acer rubrum " + std::to_string(i) + "\n";
  std::ofstream("maples.tps") << tps;
  std::ofstream("sizes.csv") << "who,size,kind\n\"Acer rubrum 5\",50,a\n\"Acer rubrum 4\",41,b\nAcer rubrum 3,30,a\n"
                                "Acer rubrum 2,22,b\nAcer rubrum 1,10,b\n";
  const ProgramRun done = run(words(
      "atlas maples.tps -o out --no-picture --covariate sizes.csv:size --groups sizes.csv:kind --permutations 9"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Strings names = {"Acer rubrum 1", "Acer rubrum 2", "Acer rubrum 3", "Acer rubrum 4", "Acer rubrum 5"};
  for (const std::string table : {"scores.csv", "specimens.csv", "procrustes_scores.csv"})
    EXPECT_EQ(column("out/" + table, "specimen"), names) << table;
  EXPECT_EQ(column("out/scores.csv", "size"), (Strings{"10", "22", "30", "41", "50"}));
  EXPECT_EQ(column("out/scores.csv", "group"), (Strings{"b", "b", "a", "b", "a"}));
  EXPECT_EQ(column("out/momenta.csv", "specimen")[4], "Acer rubrum 2");
  EXPECT_EQ(column("out/aligned.csv", "specimen")[4], "Acer rubrum 2");
  EXPECT_EQ(read_json("out/atlas.json")["specimens"][0]["name"], "Acer rubrum 1");
  EXPECT_THAT(contents("out/report.html"), HasSubstr("Acer rubrum 1"));
}

TEST_F(Names, ThatRepeatAreKeptAndNoted) {
  write_shapes("ab.csv", {"a", "b"});
  write_shapes("ac.csv", {"a", "c"});
  const ProgramRun atlas = run(words("atlas ab.csv ac.csv -o out --no-picture"));
  ASSERT_THAT(atlas.exit_code, testing::AnyOf(0, 3)) << atlas.err;
  EXPECT_EQ(column("out/scores.csv", "specimen"), (Strings{"a", "b", "a", "c"}));
  EXPECT_THAT(atlas.err, HasSubstr("2 shapes are named 'a'"));
  EXPECT_EQ(column("out/aligned.csv", "specimen")[8], "a#3");
  const ProgramRun cohort = run(words("register ab.csv ac.csv --template mean -o cohort"));
  ASSERT_THAT(cohort.exit_code, testing::AnyOf(0, 3)) << cohort.err;
  EXPECT_EQ(column("cohort/cohort.csv", "specimen"), (Strings{"a", "b", "a", "c"}));
  EXPECT_EQ(column("cohort/cohort.csv", "folder"), (Strings{"a", "b", "a_2", "c"}));
  EXPECT_THAT(cohort.err, HasSubstr("2 shapes are named 'a'"));
}

TEST_F(Names, OfShapesWithoutOneAreTheirPlaceInTheFile) {
  std::ofstream("wings.tps") << "LM=3\n0 0\n1 0\n0 1\nLM=3\n0 0\n1.1 0\n0 1\n";
  ASSERT_THAT(run(words("register wings.tps -q -o out")).exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(column("out/cohort.csv", "specimen"), (Strings{"wings#1", "wings#2"}));
  EXPECT_EQ(column("out/cohort.csv", "folder"), (Strings{"wings_1", "wings_2"}));
}

TEST_F(Names, StandBesideTheAddressesOfAComparison) {
  write_shapes("shapes.csv", {"Acer rubrum 1", "p\"2", "b", "c"});
  const ProgramRun done =
      run(words("compare shapes.csv -o out --sigma 0.05 --steps 4 --no-picture --noise none --importance 10"));
  ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  EXPECT_EQ(column("out/specimens.csv", "specimen"), (Strings{"Acer rubrum 1", "p\"2", "b", "c"}));
  EXPECT_EQ(column("out/shapes.csv", "specimen"), (Strings{"Acer rubrum 1", "p\"2", "b", "c"}));
  EXPECT_EQ(column("out/shapes.csv", "shape").front(), "shapes.csv#1");
  EXPECT_EQ(read_json("out/comparison.json")["specimens"][1], "p\"2");
}

TEST_F(Names, OfLandmarksAreQuotedInEveryTable) {
  for (const std::string name : {"a", "b"})
    std::ofstream(name + ".csv") << "label,x,y\n\"p\"\"2\",0,0\n\"a,b\",1,0." << name.front() - 'a'
                                 << "\n\"=c\nd\",0.5,1\n";
  const Strings labels = {"p\"2", "a,b", "=c\nd"};
  ASSERT_THAT(run(words("register a.csv b.csv -q --no-picture -o pair")).exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(column("pair/residuals.csv", "label"), labels);
  const ProgramRun done = run(words(
      "compare a.csv b.csv -o out --source a.csv --sigma 0.05 --steps 4 --no-picture --noise none --importance 10"));
  ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  EXPECT_EQ(column("out/landmarks.csv", "label"), labels);
  EXPECT_EQ(column("out/source.csv", "label"), labels);
}

TEST_F(Names, AreMadeSafeForSpreadsheetsWhereAsked) {
  write_shapes("shapes.csv", {"=1+1", "-2", "@a", "+b", "plain"});
  const Strings safe = {"'=1+1", "'-2", "'@a", "'+b", "plain"};
  ASSERT_THAT(run(words("register shapes.csv -q -o out")).exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(column("out/cohort.csv", "specimen").front(), "=1+1");
  const Strings rms = column("out/cohort.csv", "rms");
  ASSERT_THAT(run(words("register shapes.csv -q -o out --spreadsheet-safe")).exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(column("out/cohort.csv", "specimen"), safe);
  EXPECT_EQ(column("out/cohort.csv", "rms"), rms);
  EXPECT_EQ(read_json("out/cohort.json")["specimens"][0]["name"], "=1+1");
  ASSERT_THAT(run(words("atlas shapes.csv -q -o atlas --no-picture --spreadsheet-safe")).exit_code,
              testing::AnyOf(0, 3));
  EXPECT_EQ(column("atlas/scores.csv", "specimen"), safe);
  EXPECT_EQ(column("atlas/aligned.csv", "specimen")[0], "'=1+1");
  EXPECT_THAT(column("atlas/momenta.csv", "px"), Each(Not(HasSubstr("'"))));
  EXPECT_EQ(run(words("convert shapes.csv -q --spreadsheet-safe --out safe.csv")).exit_code, 0);
  EXPECT_EQ(column("safe.csv", "specimen")[4], "'-2");
  EXPECT_EQ(run(words("convert shapes.csv -q --spreadsheet-safe --out same.tps")).exit_code, 0);
  EXPECT_THAT(contents("same.tps"), HasSubstr("ID==1+1\n"));
}

TEST_F(Names, AddressShapesExactly) {
  write_shapes("shapes.csv", kNames);
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const ProgramRun done = run({"info", "shapes.csv#id=" + kNames[i], "--json", "-"});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(nlohmann::json::parse(done.out)["shapes"][0]["name"], kNames[i]);
  }
}

TEST_F(Names, AreKeptOrReportedByEveryFormat) {
  write_shapes("shapes.csv", kNames);
  ASSERT_EQ(run(words("convert shapes.csv shapes.json -q")).exit_code, 0);
  const ProgramRun back = run(words("convert shapes.json back.csv"));
  EXPECT_THAT(back.err, IsEmpty());
  EXPECT_EQ(run(words("convert back.csv again.json -q")).exit_code, 0);
  EXPECT_EQ(contents("again.json"), contents("shapes.json"));
  const ProgramRun tps = run(words("convert shapes.csv shapes.tps"));
  EXPECT_THAT(tps.err, HasSubstr("note: shapes.tps: tps cannot hold line breaks and outer blanks of texts"));
  const nlohmann::json info = nlohmann::json::parse(run(words("info shapes.tps --json -")).out);
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (kNames[i] == text::trim(kNames[i]) && kNames[i].find('\n') == std::string::npos) {
      EXPECT_EQ(info["shapes"][i]["name"], kNames[i]);
    }
}

TEST_F(Names, ThatAreNotUtf8AreReadAsWindows1252) {
  const std::string triangle = "LM=3\n0 0\n1 0\n0 1\n";
  std::ofstream("old.tps") << triangle << "ID=gr\xFCn\n" << triangle << "ID=rot\n";
  ASSERT_THAT(run(words("register old.tps -q -o out")).exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(column("out/cohort.csv", "specimen"), (Strings{"grün", "rot"}));
  EXPECT_EQ(read_json("out/cohort.json")["specimens"][0]["name"], "grün");
  // A file's name is no text in the file
  std::ofstream("gr\xFCn.tps") << "LM=3\n0 0\n1 0\n0 1\n";
  std::ofstream("rot.tps") << "LM=3\n0 0\n1.1 0\n0 1\n";
  const Strings files = {"gr\xFCn.tps", "rot.tps"};
  ASSERT_THAT(run(joined({"register", "rot.tps"}, joined(files, words("-q -o paths")))).exit_code,
              testing::AnyOf(0, 3));
  EXPECT_EQ(column("paths/cohort.csv", "specimen"), (Strings{"grün", "rot"}));
  EXPECT_EQ(read_json("paths/cohort.json")["specimens"][0]["source"], "gr\uFFFDn.tps");
  for (const std::string verb : {"atlas --kernel gaussian:alpha=1 --lambda 1 --sigma 0.1",
                                 "compare --sigma 0.05 --noise none --steps 3 --importance 5"}) {
    const ProgramRun done = run(joined(joined(words(verb), files), words("-q --no-picture -o " + verb.substr(0, 5))));
    EXPECT_THAT(done.exit_code, testing::AnyOf(0, 3)) << verb << done.err;
    for (const auto& [name, text] : all_files())
      if (name.ends_with(".json") || name.ends_with(".csv") || name.ends_with(".html")) {
        EXPECT_TRUE(is_utf8(text)) << name;
      }
  }
}

TEST_F(Names, WithZeroBytesAreNoted) {
  std::ofstream("zero.json") << R"({"shapes": [{"name": "a\u0000b", "points": [[0, 0], [1, 0], [0, 1]]},)"
                             << R"({"name": "c", "points": [[0, 0], [1, 0], [0, 1.1]]}]})";
  const ProgramRun done = run(words("register zero.json -o out"));
  ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  EXPECT_THAT(done.err, HasSubstr("zero bytes in names are read as U+FFFD"));
  EXPECT_EQ(column("out/cohort.csv", "specimen"), (Strings{"a\uFFFDb", "c"}));
}

}  // namespace
}  // namespace pulson
