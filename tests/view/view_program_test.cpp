// `pulson view` as a process: what it keeps when it is killed, when the disk is full, and what it exports.

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <httplib.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"
#include "pulson/images/pages.hpp"

namespace pulson {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A running program, which is killed at the end.
class Server {
 public:
  /// @param most_bytes of a file that it may write; 0: any
  explicit Server(const std::vector<std::string>& arguments, rlim_t most_bytes = 0) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    child_ = ::fork();
    if (child_ == 0) become(arguments, ends, most_bytes);
    ::close(ends[1]);
    std::string line;
    for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) line += c;
    ::close(ends[0]);
    const std::string start = "http://127.0.0.1:";
    EXPECT_TRUE(line.starts_with(start)) << line;
    const std::size_t slash = line.find('/', start.size());
    port_ = std::stoi(line.substr(start.size(), slash - start.size()));
    path_ = line.substr(slash);
  }
  ~Server() { kill(SIGKILL); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// @return the exit code, or minus the signal
  int kill(int signal) {
    if (child_ <= 0) return 0;
    ::kill(child_, signal);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  httplib::Result reply_of(const std::string& name) { return httplib::Client("127.0.0.1", port_).Get(path_ + name); }
  std::string text_of(const std::string& name, const json& body) {
    const auto result = httplib::Client("127.0.0.1", port_).Post(path_ + name, body.dump(), "application/json");
    return result && result->status == 200 ? result->body : std::string(4, '?');
  }
  std::pair<int, json> get(const std::string& name) {
    httplib::Client client("127.0.0.1", port_);
    const auto result = client.Get(path_ + name);
    return {result ? result->status : -1, result ? json::parse(result->body, nullptr, false) : json()};
  }
  std::pair<int, json> post(const std::string& name, const json& body) { return post_bytes(name, body.dump()); }
  std::pair<int, json> post_bytes(const std::string& name, const std::string& body) {
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(60);
    const auto result = client.Post(path_ + name, body, "application/octet-stream");
    return {result ? result->status : -1, result ? json::parse(result->body, nullptr, false) : json()};
  }

  json document() { return get("state").second["document"]; }
  int save(const json& document) {
    return post("state", {{"base", document["revision"]}, {"document", document}}).first;
  }

 private:
  [[noreturn]] static void become(const std::vector<std::string>& arguments, const std::array<int, 2>& ends,
                                  rlim_t most_bytes) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::close(ends[0]);
    const int null = ::open("/dev/null", O_WRONLY);
    ::dup2(null, STDERR_FILENO);
    if (most_bytes > 0) {
      const rlimit limit{most_bytes, most_bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    std::vector<std::string> all = {PULSON_PROGRAM, "view", "--no-browser"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& argument : all) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }

  pid_t child_ = -1;
  int port_ = 0;
  std::string path_;
};

class ViewProgram : public Program {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    const std::filesystem::path samples = std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes";
    for (const char* name : {"leaf_1.png", "leaf_2.png", "leaves.tps"}) std::filesystem::copy(samples / name, name);
  }

  static json placed(json document, const std::vector<std::vector<json>>& points) {
    document["landmarks"] = json::array();
    for (std::size_t k = 0; k < points[0].size(); ++k) document["landmarks"].push_back({{"name", ""}, {"group", ""}});
    for (std::size_t s = 0; s < points.size(); ++s) document["specimens"][s]["points"] = points[s];
    return document;
  }
};

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

TEST_F(ViewProgram, ExportsWhatWasPlacedInRowsOfThePicture) {
  Server server({"leaf_1.png", "leaf_2.png"});
  server.save(
      placed(server.document(), {{json::array({10, 20}), json::array({30.5, 40})}, {json::array({1, 2}), "missing"}}));
  const auto [status, reply] = server.post("export", {{"name", "out.csv"}});
  EXPECT_EQ(status, 200) << reply;
  const formats::LandmarkFile read = formats::read_landmark_file("out.csv");
  ASSERT_EQ(read.shapes.size(), 2U);
  EXPECT_EQ(read.shapes[0].points, (Points{{10, 30.5}, {20, 40}}));
  EXPECT_TRUE(std::isnan(read.shapes[1].points(0, 1)));
  // In tps y counts up from the lower edge of 400 rows; pulson's convention for it is that of Frame.
  EXPECT_EQ(server.post("export", {{"name", "out.tps"}}).first, 200);
  const Landmarks up = formats::read_landmark_file("out.tps").shapes[0];
  EXPECT_FALSE(up.frame.y_down);
  EXPECT_EQ(up.points(1, 0), 400 - 20);
  EXPECT_EQ(up.image, "leaf_1.png");
}

TEST_F(ViewProgram, OpenedShapesComeBackAsTheyWere) {
  const formats::LandmarkFile before = formats::read_landmark_file("leaves.tps");
  Server server({"leaves.tps"});
  EXPECT_EQ(server.document()["specimens"].size(), before.shapes.size());
  EXPECT_EQ(server.document()["specimens"][0]["picture"], "leaf_1.png");
  EXPECT_EQ(server.post("export", {{"name", "leaves.tps"}}).first, 422) << "without --in-place";
  EXPECT_EQ(server.post("export", {{"name", "leaf_1.png"}}).first, 422);
  EXPECT_EQ(server.post("export", {{"name", "../x.tps"}}).first, 422);
  const auto [status, reply] = server.post("export", {{"name", "copy.tps"}});
  EXPECT_EQ(status, 200) << reply;
  const formats::LandmarkFile after = formats::read_landmark_file("copy.tps");
  ASSERT_EQ(after.shapes.size(), before.shapes.size());
  for (std::size_t i = 0; i < before.shapes.size(); ++i) {
    EXPECT_LT((after.shapes[i].points - before.shapes[i].points).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(after.shapes[i].scale, before.shapes[i].scale);
    EXPECT_EQ(after.shapes[i].name, before.shapes[i].name);
  }
}

// What is exported after the session alone was opened again, without the landmark file, is what was before: in every
// format that is written, for files that say their picture, frame and scale themselves and for those that do not.
TEST_F(ViewProgram, ASessionThatIsOpenedAgainExportsTheSame) {
  write("plain.csv", "x,y\n10,20.1\n50,60\n90,30\n");
  write("alone.tps", "LM=3\n10 20\n50 60\n90 30\nIMAGE=elsewhere.jpg\nID=one\nCOMMENT=old\nSCALE=0.01\n");
  std::filesystem::copy("leaves.tps", "pair.tps");
  std::filesystem::copy("alone.tps", "named.tps");
  const std::vector<std::vector<std::string>> sessions = {{"leaves.tps"},
                                                          {"plain.csv", "leaf_1.png", "--flip-y"},
                                                          {"named.tps", "leaf_2.png"},
                                                          {"alone.tps"},
                                                          {"pair.tps", "--scale", "apply"}};
  std::set<std::string> written;
  const auto exported = [&](Server& server, const std::string& stem) {
    std::map<std::string, std::string> files;
    for (const formats::LandmarkFormat& format : formats::landmark_formats())
      if (format.write != nullptr) {
        const std::string name = stem + "." + format.extensions[0];
        const auto [status, reply] = server.post("export", {{"name", name}});
        files[format.name] = status == 200 ? contents(name) : reply["error"].get<std::string>();
        if (status == 200) written.insert(format.name);
        std::filesystem::remove(name);
      }
    return files;
  };
  for (const std::vector<std::string>& session : sessions) {
    const std::string stem = std::filesystem::path(session[0]).stem().string();
    std::map<std::string, std::string> before;
    {
      Server server(session);
      json document = server.document();
      document["specimens"][0]["points"][0] = json::array({5, 7});
      EXPECT_EQ(server.save(document), 200);
      before = exported(server, "out");
    }
    std::filesystem::remove(session[0]);
    Server again({stem + ".pulson.json"});
    EXPECT_EQ(exported(again, "out"), before) << stem;
  }
  // Those that hold one shape are written of one, bigwarp of none of these.
  EXPECT_THAT(written, testing::ElementsAre("csv", "elastix", "fcsv", "ibug", "json", "mrk.json", "npy", "tps", "vtk"));
}

TEST_F(ViewProgram, LandmarksThatWereNotMovedAreExportedAsTheirFileHasThem) {
  Server server({"leaves.tps"});
  EXPECT_EQ(server.post("export", {{"name", "copy.tps"}}).first, 200);
  const auto before = formats::read_landmark_file("leaves.tps").shapes,
             after = formats::read_landmark_file("copy.tps").shapes;
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].points, before[i].points);
    EXPECT_EQ(after[i].frame.y_down, before[i].frame.y_down);
    EXPECT_EQ(after[i].frame.unit_per_pixel, before[i].frame.unit_per_pixel) << "also without a picture";
  }
}

TEST_F(ViewProgram, FilesAreAddedToASessionOnce) {
  write("more.csv", "x,y\n10,20\n50,60\n");
  const std::vector<std::size_t> specimens = {8, 9, 9};
  const std::vector<std::vector<std::string>> lines = {
      {"leaves.tps"}, {"leaves.tps", "more.csv"}, {"leaves.tps", "more.csv", "leaf_1.png"}};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Server server(lines[i]);
    const json document = server.document();
    EXPECT_EQ(document["specimens"].size(), specimens[i]);
    EXPECT_FALSE(document.contains("shapes")) << "the page has no use for them";
    EXPECT_EQ(server.save(document), 200);
  }
}

// A light square in rows as they are stored, and its centre as a landmark, of each orientation of EXIF: the landmark is
// where the page shows the square, and comes back where it was.
TEST_F(ViewProgram, LandmarksStayOnTurnedPictures) {
  constexpr int kWide = 90, kHigh = 60;
  images::Page page{images::Image(kWide, kHigh, 1, images::PixelType::kUint8), {}};
  for (int y = 10; y < 18; ++y)
    for (int x = 16; x < 24; ++x) page.image.values<std::uint8_t>()[static_cast<std::size_t>(y * kWide + x)] = 255;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string name = fmt::format("turned_{}", orientation);
    page.about.orientation = orientation;
    images::write_pages(name + ".tif", std::vector{page});
    write(name + ".csv", "x,y\n19.5,13.5\n50,30\n");
    Server server({name + ".csv", name + ".tif"});
    const json specimen = server.document()["specimens"][0];
    const images::Image shown = images::decode_image(server.reply_of("picture?name=0")->body);
    EXPECT_EQ(json::array({shown.width(), shown.height()}), json::array({specimen["width"], specimen["height"]}));
    Eigen::Vector2d centre(0, 0);
    double sum = 0;
    for (int y = 0; y < shown.height(); ++y)
      for (int x = 0; x < shown.width(); ++x)
        if (const double light = shown.at(x, y, 0); light > 60) centre += light * Eigen::Vector2d(x, y), sum += light;
    centre /= sum;
    // The page's picture is a jpg, whose edges are not quite symmetric.
    EXPECT_NEAR(centre.x(), specimen["points"][0][0], 0.3) << orientation;
    EXPECT_NEAR(centre.y(), specimen["points"][0][1], 0.3) << orientation;
    EXPECT_EQ(server.post("export", {{"name", name + "_back.csv"}}).first, 200);
    const Points back = formats::read_landmark_file(name + "_back.csv").shapes[0].points;
    EXPECT_LT((back - Points{{19.5, 50}, {13.5, 30}}).cwiseAbs().maxCoeff(), 1e-9) << orientation;
  }
}

TEST_F(ViewProgram, InPlaceKeepsTheFirstState) {
  const std::string first = contents("leaves.tps");
  Server server({"leaves.tps", "--in-place"});
  json document = server.document();
  document["specimens"][0]["points"][0] = json::array({5, 5});
  EXPECT_EQ(server.save(document), 200);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(server.post("export", {{"name", "leaves.tps"}}).first, 200);
  EXPECT_EQ(contents("leaves.first.tps"), first);
  EXPECT_NE(contents("leaves.tps"), first);
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
