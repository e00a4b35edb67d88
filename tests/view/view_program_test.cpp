// `pulson view` as a process: what it keeps when it is killed, when the disk is full, and what it refuses.

#include "view_program.hpp"

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace pulson {
namespace {

using testing::HasSubstr;

TEST_F(ViewProgram, KeepsTheLastSavedActionWhenItIsKilled) {
  json last;
  {
    Server server({"leaf_1.png", "leaf_2.png"});
    json document = server.document();
    EXPECT_EQ(document["specimens"].size(), 2U);
    EXPECT_EQ(document["specimens"][0]["width"], 300);
    for (int k = 1; k <= 3; ++k) {
      const std::vector<json> points(static_cast<std::size_t>(k), json::array({10 * k, 20}));
      document = placed(server.document(), {points, std::vector<json>(static_cast<std::size_t>(k), nullptr)});
      EXPECT_EQ(server.save(document), 200);
    }
    last = server.document();
    EXPECT_EQ(server.kill(SIGKILL), -SIGKILL);
  }
  Server again({"leaf_1.png", "leaf_2.png"});
  json now = again.document();
  EXPECT_GT(now["revision"], last["revision"]);
  now["revision"] = last["revision"];
  EXPECT_EQ(now, last);
  EXPECT_EQ(again.kill(SIGTERM), 0);
}

TEST_F(ViewProgram, TwoWindowsCannotOverwriteEachOther) {
  Server server({"leaf_1.png", "leaf_2.png"});
  const json first = server.document();
  EXPECT_EQ(server.save(placed(first, {{json::array({1, 2})}, {nullptr}})), 200);
  const auto [status, reply] = server.post(
      "state", {{"base", first["revision"]}, {"document", placed(first, {{json::array({3, 4})}, {nullptr}})}});
  EXPECT_EQ(status, 409);
  EXPECT_EQ(reply["document"]["specimens"][0]["points"][0], json::array({1.0, 2.0}));
  EXPECT_EQ(server.document()["specimens"][0]["points"][0], json::array({1.0, 2.0}));
}

TEST_F(ViewProgram, AFullDiskIsSaidAndTakesNothingAway) {
  std::string before;
  {
    Server server({"leaf_1.png", "leaf_2.png"});
    EXPECT_EQ(server.save(placed(server.document(), {{json::array({1, 2})}, {json::array({5, 6})}})), 200);
    before = contents("leaf_1.pulson.json");
  }
  Server server({"leaf_1.png", "leaf_2.png"}, static_cast<rlim_t>(before.size() + 100));
  const std::string kept = contents("leaf_1.pulson.json");
  std::vector<json> many(100, json::array({1, 2}));
  const auto [status, reply] = server.post(
      "state", {{"base", server.document()["revision"]}, {"document", placed(server.document(), {many, many})}});
  EXPECT_EQ(status, 507);
  EXPECT_THAT(reply["error"].get<std::string>(), HasSubstr("leaf_1.pulson.json"));
  EXPECT_EQ(contents("leaf_1.pulson.json"), kept);
  EXPECT_EQ(server.document()["landmarks"].size(), 1U);
}

TEST_F(ViewProgram, TakesPicturesThatAreDroppedAndNothingElse) {
  Server server({});
  EXPECT_EQ(server.post_bytes("picture?name=a.png", contents("leaf_1.png")).first, 200);
  EXPECT_EQ(server.document()["specimens"][0]["height"], 400);
  EXPECT_EQ(server.post_bytes("picture?name=a.png", contents("leaf_1.png")).first, 200) << "the same again";
  EXPECT_EQ(server.document()["specimens"].size(), 1U);
  EXPECT_EQ(server.post_bytes("picture?name=a.png", contents("leaf_2.png")).first, 422);
  const auto [status, reply] = server.post_bytes("picture?name=b.png", contents("leaf_2.png").substr(0, 900));
  EXPECT_EQ(status, 422);
  EXPECT_THAT(reply["error"].get<std::string>(), HasSubstr("b.png"));
  EXPECT_FALSE(std::filesystem::exists("b.png"));
  EXPECT_EQ(server.post_bytes("picture?name=../c.png", contents("leaf_2.png")).first, 422);
  EXPECT_EQ(server.get("picture?name=0").first, 200);
  EXPECT_EQ(server.get("picture?name=7").first, 404);
  EXPECT_EQ(server.get("leaf_1.png").first, 403);
}

TEST_F(ViewProgram, ShowsOnlyPicturesThatWereOpened) {
  Server server({"leaf_1.png", "leaf_2.png"});
  json document = server.document();
  document["specimens"][0]["picture"] = "/etc/passwd";
  EXPECT_EQ(server.save(document), 422);
}

TEST_F(ViewProgram, RefusesWhatItCannotOpen) {
  write("broken.png", contents("leaf_1.png").substr(0, 500));
  write("space.csv", "x,y,z\n1,2,3\n4,5,6\n");
  for (const auto& [line, words_of_it] : {std::pair("view --no-browser broken.png", "broken.png"),
                                          std::pair("view --no-browser none.png", "no such file"),
                                          std::pair("view --no-browser space.csv", "in the plane"),
                                          std::pair("view --no-browser a.pulson.json b.pulson.json", "no such file")}) {
    const ProgramRun done = run(words(line));
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_THAT(done.err, HasSubstr(words_of_it));
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    EXPECT_EQ(done.out, "");
  }
}

TEST_F(ViewProgram, A400MegapixelPictureIsRefusedAndOneOf100IsShownReduced) {
  for (const int side : {10'000, 20'000}) {
    const std::string name = fmt::format("{}.pgm", side);
    write(name, fmt::format("P5 {} {} 255\n", side, side));
    std::filesystem::resize_file(name, std::filesystem::file_size(name) + static_cast<std::uintmax_t>(side) * side);
  }
  const ProgramRun refused = run({"view", "--no-browser", "20000.pgm"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("20000 x 20000 pixels, more than --max-pixels 200000000 allows"));
  Server server({"10000.pgm"});
  EXPECT_EQ(server.document()["specimens"][0]["width"], 10'000) << "positions are of the whole";
  EXPECT_EQ(server.get("picture?name=0").first, 200);
}

TEST_F(ViewProgram, OfHundredsOfSavesAtOnceOneWinsAndTheOthersAreToldSo) {
  Server server({"leaf_1.png", "leaf_2.png"});
  const json first = server.document();
  std::atomic<int> saved = 0, refused = 0;
  std::vector<std::thread> windows;
  windows.reserve(20);
  for (int w = 0; w < 20; ++w)
    windows.emplace_back([&, w] {
      for (int i = 0; i < 25; ++i) {
        const json document = placed(first, {{json::array({w, i})}, {nullptr}});
        const int status = server.post("state", {{"base", first["revision"]}, {"document", document}}).first;
        saved += status == 200 ? 1 : 0;
        refused += status == 409 ? 1 : 0;
      }
    });
  for (std::thread& window : windows) window.join();
  EXPECT_EQ(saved, 1);
  EXPECT_EQ(refused, 499);
  const json now = server.document();
  EXPECT_EQ(now["revision"], first["revision"].get<int>() + 1);
  EXPECT_EQ(now, json::parse(contents("leaf_1.pulson.json")));
}

TEST_F(ViewProgram, AMatchFollowsTheLastOneAndRefusesWhatIsNoRequest) {
  Server server({"leaf_1.png", "leaf_2.png"});
  json request{{"left", {{10, 10}, {90, 10}, {90, 70}, {10, 70}}},
               {"right", {{12, 10}, {90, 14}, {88, 70}, {10, 75}}},
               {"width", 100},
               {"height", 80},
               {"columns", 5},
               {"rows", 4}};
  const auto is_followed = [&] {
    const std::string head = server.text_of("match", request).substr(4);
    EXPECT_THAT(head, HasSubstr("\"converged\":true"));
    return head.find("\"followed\":true") != std::string::npos;
  };
  request["follow"] = true;
  EXPECT_FALSE(is_followed()) << "there is none to follow";
  request["right"][0][0] = 14;
  EXPECT_TRUE(is_followed());
  request["follow"] = false;
  EXPECT_FALSE(is_followed());
  request["right"][0] = "absent";
  request["follow"] = true;
  EXPECT_FALSE(is_followed()) << "of other landmarks";
  request["right"][1] = nullptr;
  for (const json& wrong : {request, json{{"left", 1}}}) EXPECT_EQ(server.post("match", wrong).first, 422);
}

TEST_F(ViewProgram, OpensThePageOfResults) {
  std::filesystem::create_directories("out");
  const ProgramRun none = run({"view", "--no-browser", "out"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("'out' has no report.html"));
  std::ofstream("out/report.html") << "<!DOCTYPE html>";
  const ProgramRun done = run({"view", "--no-browser", "out"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.out, std::filesystem::absolute("out/report.html").lexically_normal().string() + "\n");
}

TEST_F(ViewProgram, OpensThePicturesOfResultsAndTheirReport) {
  ASSERT_EQ(run({"register", "leaves.tps#1", "leaves.tps#2", "-o", "out"}).exit_code, 0);
  {
    Server server({"out"});
    const json document = server.document();
    ASSERT_EQ(document["specimens"].size(), 2U);
    EXPECT_EQ(document["specimens"][1]["picture"], "leaf_2.png");
    EXPECT_EQ(document["specimens"][1]["shape"], "leaves.tps#2");
    EXPECT_EQ(server.get("state").second["report"], true);
    EXPECT_EQ(server.get("state").second["export"], "out.tps") << "not the file of all specimens";
    const httplib::Result report = server.reply_of("report.html");
    ASSERT_TRUE(report);
    EXPECT_EQ(report->body, contents("out/report.html"));
    EXPECT_THAT(report->get_header_value("Content-Security-Policy"), testing::StartsWith("sandbox allow-scripts;"));
    EXPECT_EQ(report->get_header_value_count("Content-Security-Policy"), 1U);
    EXPECT_EQ(server.get("registration.json").first, 403);
    EXPECT_EQ(server.save(document), 200);
  }
  // Results that were made anew, of others.
  run({"register", "leaves.tps#1", "leaves.tps#3", "-o", "out"});
  const ProgramRun other = run({"view", "--no-browser", "out"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err,
              HasSubstr("out.pulson.json is a session of other shapes than these results, without leaves.tps#3"));
  // Where the pictures are no longer there, the report is.
  std::filesystem::remove("leaf_1.png");
  std::filesystem::remove("leaf_2.png");
  const ProgramRun report = run({"view", "--no-browser", "out"});
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(report.out, HasSubstr("out/report.html"));
  EXPECT_THAT(report.err, HasSubstr("its shapes have no pictures"));
}

}  // namespace
}  // namespace pulson
