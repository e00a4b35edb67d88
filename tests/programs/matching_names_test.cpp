// How landmarks, rows of tables and tips of trees find their partners through the program: by names, or not at all.

#include <fstream>
#include <random>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class MatchingNames : public Program {
 protected:
  /// A cohort in tps whose shapes have these names, and a table of `name,size`.
  static void write_cohort(const std::vector<std::string>& names) {
    std::ofstream file("cohort.tps");
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto x = static_cast<double>(i);
      file << "LM=5\n0 0\n10 " << 0.03 * x * x << "\n"
           << 10 + 0.2 * x << " 8\n"
           << 0.05 * x << " 9\n5 " << 4 + 0.1 * x << "\nID=" << names[i] << "\n";
    }
  }

  static void write_sizes(const std::vector<std::string>& names, const std::string& file = "sizes.csv") {
    std::ofstream table(file);
    table << "specimen,size\n";
    for (std::size_t i = names.size(); i > 0; --i) table << names[i - 1] << "," << i << "\n";
  }

  static ProgramRun atlas(const std::string& more = "--covariate sizes.csv:size --permutations 9") {
    return run(words("atlas cohort.tps -o out --no-picture --kernel gaussian:alpha=5 --lambda 1 --sigma 0.1 " + more));
  }

  static std::vector<double> covariates() {
    std::vector<double> values;
    const nlohmann::json record = read_json("out/atlas.json");
    for (const auto& specimen : record["specimens"]) values.push_back(specimen["size"]);
    return values;
  }

  static void write_pair(const std::string& first, const std::string& second) {
    write("a.csv", first);
    write("b.csv", second);
  }

  static ProgramRun register_pair(const std::string& more = "") {
    return run(words("register a.csv b.csv -o out --no-picture --kernel gaussian:alpha=50 --lambda 1e-4 " + more));
  }
};

const std::string kFish = "label,x,y\nnose,0,0\ntail,100,3\nfin,50,20\neye,10,8\nvent,60,-12\n";

// The landmarks of kFish, moved a little, in another order.
std::string moved_fish(const std::string& fin, const std::string& nose, const std::string& vent,
                       const std::string& tail, const std::string& eye) {
  return "label,x,y\n" + fin + ",52,22\n" + nose + ",1,0\n" + vent + ",61,-13\n" + tail + ",103,5\n" + eye + ",11,9\n";
}

TEST_F(MatchingNames, PairsLandmarksThatDifferInHowTheyAreWritten) {
  write_pair(kFish, moved_fish("fin", "nose", "vent", "tail", "eye"));
  ASSERT_EQ(register_pair().exit_code, 0);
  const double rms = read_json("out/registration.json")["rms"];
  for (const std::string& other : {moved_fish("Fin", "Nose", "VENT", "tail", "Eye"),
                                   moved_fish("lm_fin", "lm-nose", "LM vent", "lm_tail", "lm_eye"),
                                   moved_fish("fin_2", "nose_2", "vent_2", "tail_2", "eye_2"),
                                   moved_fish("\" fin \"", "nose", "vent", "tail", "eye")}) {
    write("b.csv", other);
    const ProgramRun done = register_pair();
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(read_json("out/registration.json")["rms"], rms) << other;
    EXPECT_THAT(done.err, HasSubstr("b.csv: its landmarks are in a different order")) << other;
  }
  EXPECT_THAT(register_pair().err, HasSubstr("note: "));
}

// Names of one side contradict nothing; that the order decides is said.
TEST_F(MatchingNames, NotesThatOneSideHasNone) {
  write_pair(kFish, "x,y\n1,0\n103,5\n52,22\n11,9\n61,-13\n");
  const ProgramRun done = register_pair();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("note: b.csv does not name its landmarks; they are paired with those of a.csv by "));
}

TEST_F(MatchingNames, RefusesLandmarksThatDoNotCorrespond) {
  const auto error_with = [&](const std::string& first, const std::string& second) {
    write_pair(first, second);
    const ProgramRun done = register_pair();
    EXPECT_EQ(done.exit_code, 2) << done.err;
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    return done.err;
  };
  EXPECT_THAT(error_with(kFish, moved_fish("fin", "nose", "vents", "tails", "eyes")),
              AllOf(HasSubstr("only 2 of the smaller shape's 5 landmarks have a partner"),
                    HasSubstr("'tail', 'eye', 'vent' of a.csv"), HasSubstr("'vents', 'tails', 'eyes' of b.csv"),
                    HasSubstr("--by-order pairs them")));
  EXPECT_THAT(error_with(kFish, "x,y\n1,0\n103,5\n52,22\n11,9\n"), HasSubstr("a.csv names its landmarks"));
  EXPECT_THAT(error_with("id,x,y\n0,0,0\n1,100,3\n2,50,20\n", "id,x,y\n1,1,0\n3,52,22\n2,103,5\n"),
              HasSubstr("either 0 of the one is 1 of the other, or equal numbers are the same"));
  EXPECT_THAT(error_with("x,y\n0,0\n1,0\n1,1\n0,1\n", "x,y\n0,0\n1,0\n1,1\n"),
              HasSubstr("nothing says which of them correspond"));
}

TEST_F(MatchingNames, TakesTheOrderWhereItIsAsked) {
  write_pair("label,x,y\na,0,0\nb,100,3\nc,50,20\n", "label,x,y\nu,1,0\nv,103,5\nw,52,22\n");
  ASSERT_EQ(register_pair().exit_code, 2);
  ASSERT_EQ(register_pair("--by-order").exit_code, 0);
  EXPECT_EQ(read_json("out/registration.json")["target"].size(), 3U);
  for (const std::string line :
       {"compare a.csv b.csv --noise none --no-maps --importance 10 --sigma 1", "atlas a.csv b.csv --align translation",
        "register a.csv b.csv --template mean --align translation"}) {
    EXPECT_THAT(run(words(line + " -o all --no-picture")).err, HasSubstr("--by-order pairs them")) << line;
    EXPECT_THAT(run(words(line + " -o all --no-picture --by-order")).exit_code, testing::AnyOf(0, 3)) << line;
  }
}

TEST_F(MatchingNames, OfNumbersKnowsWaysToWriteThem) {
  write_pair("id,x,y\n1,0,0\n2,100,3\n3,50,20\n4,10,8\n", "id,x,y\n01,1,0\n02,103,5\n04,11,9\n03,52,22\n");
  ASSERT_EQ(register_pair().exit_code, 0);
  const double rms = read_json("out/registration.json")["rms"];
  for (const char* const other :
       {"id,x,y\nLM1,1,0\nLM2,103,5\nLM4,11,9\nLM3,52,22\n", "id,x,y\n1_b,1,0\n2_b,103,5\n4_b,11,9\n3_b,52,22\n",
        "x,y\n1,0\n103,5\n52,22\n11,9\n"}) {
    write("b.csv", other);
    ASSERT_EQ(register_pair().exit_code, 0) << other;
    EXPECT_NEAR(read_json("out/registration.json")["rms"].get<double>(), rms, 1e-9) << other;
  }
}

TEST_F(MatchingNames, GivesSpecimensTheirRows) {
  const std::vector<std::string> names = {"Acer 1", "Acer 2", "Acer 3", "Acer 4", "Acer 5"};
  write_cohort(names);
  for (const std::vector<std::string>& rows :
       std::vector<std::vector<std::string>>{names,
                                             {"acer_1", "ACER-2", "acer 3", "Acer4", "Acer_005"},
                                             {"img/Acer 1.jpg", "img/Acer 2.jpg", "Acer 3.TIF", "Acer 4", "Acer 5.png"},
                                             {"1", "2", "3", "4", "5"},
                                             {"Acer 1", "Acer 2", "Acer 3", "Acer 4", "Acer 5", "Acer 6", "Acer 7"}}) {
    write_sizes(rows);
    const ProgramRun done = atlas();
    ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
    EXPECT_EQ(covariates(), (std::vector<double>{1, 2, 3, 4, 5})) << rows.front();
    if (rows.size() > names.size()) {
      EXPECT_THAT(done.err, HasSubstr("sizes.csv: 2 rows belong to no shape and are not used"));
    } else {
      EXPECT_EQ(rows == names, done.err.find("names matched after ignoring") == std::string::npos) << done.err;
    }
  }
}

// As R and pandas write tables: with the number of each row, or its name, before the columns.
TEST_F(MatchingNames, TakesAColumnOfNamesBeforeNumbersOfRows) {
  write_cohort({"1", "2", "3", "4", "5"});
  write("sizes.csv", R"("","id","size"
"1","4",4
"2","1",1
"3","5",5
"4","2",2
"5","3",3
)");
  ASSERT_THAT(atlas().exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(covariates(), (std::vector<double>{1, 2, 3, 4, 5}));
  write_cohort({"A", "B", "C", "D", "E"});
  write("sizes.csv", "age size\nC 7 3\nA 9 1\nB 5 2\nE 6 5\nD 8 4\n");
  EXPECT_THAT(atlas().err, HasSubstr("rows belong to shapes by the first column, which has no name"));
  EXPECT_EQ(covariates(), (std::vector<double>{1, 2, 3, 4, 5}));
}

TEST_F(MatchingNames, RefusesTablesWhoseKeyOrWidthIsInDoubt) {
  write_cohort({"A", "B", "C", "D", "E"});
  write("sizes.csv", "one,two,size\nA,B,1\nB,C,2\nC,D,3\nD,E,4\nE,A,5\n");
  EXPECT_THAT(atlas().err, HasSubstr("the columns 'one' and 'two' both hold names of the shapes"));
  write("sizes.csv", "id,age,size\nA,7,1\nB,6,2,9\nC,5,3\nD,4,4\nE,3,5\n");
  EXPECT_THAT(atlas().err, HasSubstr("sizes.csv:3: has 4 fields, more than the 3 of the header"));
  write_cohort({"1", "2", "3", "4", "5"});
  write("sizes.csv", "age,size\n1,4\n2,5\n3,6\n4,7\n5,8\n");
  EXPECT_THAT(atlas().err, HasSubstr("no column holds the names of the shapes"));
}

// A covariate that looks like the numbers in the names is no key.
TEST_F(MatchingNames, RefusesATableWithAMisspeltName) {
  write_cohort({"S1", "S2", "S3", "S4", "S5"});
  write("sizes.csv", "id,rank,size\nS5 x,1,5\nS1,2,1\nS2,3,2\nS3,4,3\nS4,5,4\n");
  const ProgramRun failed = atlas();
  EXPECT_EQ(failed.exit_code, 2);
  EXPECT_THAT(failed.err, AllOf(HasSubstr("1 of 5 shapes has no row of its own in the column 'id': 'S5'"),
                                HasSubstr("rows of no shape: 'S5 x'"), HasSubstr("--by-order")));
  EXPECT_FALSE(std::filesystem::exists("out/atlas.json"));
  write("sizes.csv", "size\n5\n1\n2\n3\n4\n");
  EXPECT_THAT(atlas().err, HasSubstr("no column holds the names of the shapes"));
  ASSERT_THAT(atlas("--covariate sizes.csv:size --permutations 9 --by-order").exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(covariates(), (std::vector<double>{5, 1, 2, 3, 4}));
  write("sizes.csv", "id,size\nS1,1\nS1,2\nS2,3\nS3,4\nS4,5\n");
  EXPECT_THAT(atlas().err, AllOf(HasSubstr("'S1', 'S1' are alike"), HasSubstr("'S1', 'S5'")));
}

TEST_F(MatchingNames, TakesTheOrderWhereNeitherTableNorShapesHaveNames) {
  write_cohort({"1", "2", "3", "4"});
  std::string text = contents("cohort.tps");
  for (std::size_t at = text.find("ID="); at != std::string::npos; at = text.find("ID=")) text.erase(at, 5);
  write("cohort.tps", text);
  write("sizes.csv", "size\n3\n1\n2\n5\n");
  ASSERT_THAT(atlas().exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(covariates(), (std::vector<double>{3, 1, 2, 5}));
}

TEST_F(MatchingNames, OfImagesServeWhereTheyAreInTheTable) {
  write_cohort({"0", "1", "2", "3"});
  std::string text = contents("cohort.tps");
  for (int i = 0; i < 4; ++i) {
    const std::string id = "ID=" + std::to_string(i);
    text.insert(text.find(id), "IMAGE=fish_" + std::string(1, "dbca"[i]) + ".jpg\n");
  }
  write("cohort.tps", text);
  write("sizes.csv", "image,size\nfish_a.jpg,1\nfish_b.jpg,2\nfish_c.jpg,3\nfish_d.jpg,4\n");
  ASSERT_THAT(atlas().exit_code, testing::AnyOf(0, 3));
  EXPECT_EQ(covariates(), (std::vector<double>{4, 2, 3, 1}));
}

// Every name of a large table that is wrong is listed, and nothing is computed.
TEST_F(MatchingNames, ListsEveryChangedNameOfALargeTable) {
  std::mt19937 random(11);
  std::vector<std::string> names, changed;
  for (int i = 0; i < 1000; ++i) names.push_back("specimen_" + std::to_string(1000 + i));
  write_cohort(names);
  std::vector<std::string> rows = names;
  for (int k = 0; k < 10; ++k) {
    std::string& name = rows[static_cast<std::size_t>(100 * k) + random() % 100];
    changed.push_back(name);
    name[random() % name.size()] = 'Q';
  }
  write_sizes(rows);
  const ProgramRun failed = atlas();
  EXPECT_EQ(failed.exit_code, 2);
  for (const std::string& name : changed) EXPECT_THAT(failed.err, HasSubstr("'" + name + "'"));
  EXPECT_THAT(failed.err, HasSubstr("10 of 1000 shapes have no row of their own"));
  EXPECT_FALSE(std::filesystem::exists("out/atlas.json"));
}

TEST_F(MatchingNames, WeighsLandmarksByLabels) {
  write_pair(kFish, moved_fish("fin", "nose", "vent", "tail", "eye"));
  write("ordered.csv", "0\n1\n1\n1\n0.5\n");
  write("labelled.csv", "landmark,weight\neye,1\nVent,0.5\nnose,0\nfin,1\ntail,1\nlip,7\n");
  write("short.csv", "landmark,weight\neye,1\nvent,0.5\nnose,0\nfin,1\nlip,7\n");
  const ProgramRun labelled = register_pair("--weights labelled.csv");
  ASSERT_EQ(labelled.exit_code, 0) << labelled.err;
  EXPECT_THAT(labelled.err, AllOf(HasSubstr("labelled.csv: 1 row belongs to no landmark and is not used"),
                                  HasSubstr("ignoring case: 'vent' with 'Vent'")));
  const double rms = read_json("out/registration.json")["rms"];
  EXPECT_THAT(register_pair("--weights ordered.csv").err, HasSubstr("a.csv names its landmarks ('nose', …)"));
  ASSERT_EQ(register_pair("--weights ordered.csv --by-order").exit_code, 0);
  write("b.csv", "label,x,y\nnose,1,0\ntail,103,5\nfin,52,22\neye,11,9\nvent,61,-13\n");
  ASSERT_EQ(register_pair("--weights ordered.csv --by-order").exit_code, 0);
  EXPECT_NEAR(read_json("out/registration.json")["rms"].get<double>(), rms, 1e-9);
  EXPECT_THAT(register_pair("--weights short.csv").err,
              HasSubstr("short.csv has no row for 1 of the 5 landmarks of a.csv, and each needs a weight: 'tail'"));
}

TEST_F(MatchingNames, FindsTheTipsOfATree) {
  write("root.csv", "x,y\n0,0\n1,0\n0,1\n");
  write("tips.csv",
        "shape,x,y\nHomo sapiens,0,0.1\nHomo sapiens,1.1,0\nHomo sapiens,0,1\nPan,0,0\nPan,0.9,0\nPan,0,1.1\n");
  write("tree.nwk", "(homo_sapiens:1,PAN:1);\n");
  const ProgramRun done =
      run(words("sample root.csv tips.csv --tree tree.nwk --noise ch-sd:beta=1 --kernel "
                "gaussian:alpha=1 --sigma 0.1 --draws 8 --warmup 8 --chains 2 "
                "--steps 2 -o out --no-picture"));
  EXPECT_NE(done.exit_code, 2) << done.err;
  EXPECT_THAT(done.err, HasSubstr("names matched after ignoring case"));
  write("tree.nwk", "(homo_erectus:1,Pan:1);\n");
  EXPECT_THAT(run(words("sample root.csv tips.csv --tree tree.nwk --noise ch-sd:beta=1 -o out")).err,
              HasSubstr("the tree has no node 'Homo sapiens'"));
}

}  // namespace
}  // namespace pulson
