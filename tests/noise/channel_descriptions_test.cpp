// What models say of their channels is enough to write each potential down.

#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "noise_contract.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// One channel as a reader of docs/replaying.md writes it down.
class DescribedChannel {
 public:
  DescribedChannel(const NoiseChannel& channel, const Landmarks& shape)
      : channel_(channel), spec_(parse_spec_sum(channel.noise, "noise").front()), shape_(shape) {}

  double potential(const PhaseState& at) const {
    const std::string& name = spec_.name;
    double sum = 0;
    for (const int a : landmarks()) {
      if (name == "ch-sd") sum += number("beta") * at.p(axis(), a);
      if (name == "ch-sd-screened") sum += number("beta") * at.p(axis(), a) * screen(at, a);
      if (name == "p-sd") sum += number("beta") * at.p(axis(), a) * field(at.q.col(a));
      if (name == "trouve-vialard" || name == "langevin") sum += number("sigma") * at.q(axis(), a);
    }
    const int b = landmarks().front();
    for (int a = 0; a < kCount && name == "kunita"; ++a)
      sum += number("beta") * at.p(axis(), a) * bump(at, a, b, number("width") * number("width"));
    if (name == "potential") sum = pairs(at);
    return sum;
  }

 private:
  double number(const std::string& key) const { return std::stod(spec_.values.at(key)); }
  int axis() const { return channel_.axis.value(); }
  std::vector<int> landmarks() const {
    std::vector<int> all(kCount);
    std::iota(all.begin(), all.end(), 0);
    return channel_.landmarks.empty() ? all : channel_.landmarks;
  }
  static double bump(const PhaseState& at, int a, int b, double squared_width) {
    return std::exp(-(at.q.col(a) - at.q.col(b)).squaredNorm() / squared_width);
  }
  double screen(const PhaseState& at, int a) const {
    const auto group = [&](int b) { return shape_.groups.empty() ? b : shape_.groups[b].front(); };
    double sum = 0;
    for (int b = 0; b < kCount; ++b)
      if (group(a) != group(b)) sum += bump(at, a, b, number("gamma"));
    return sum;
  }
  double field(const Eigen::VectorXd& x) const {
    if (channel_.wavevector.size() > 0) return std::cos(channel_.wavevector.dot(x));
    if (channel_.center.size() == 0) return 1;
    return std::exp(-(x - channel_.center).squaredNorm() / std::pow(number("width"), 2));
  }
  double pairs(const PhaseState& at) const {
    double sum = 0;
    for (const int a : landmarks())
      for (const int b : landmarks())
        if (a < b) sum += number("beta") * bump(at, a, b, number("gamma"));
    return sum;
  }

  const NoiseChannel& channel_;
  Spec spec_;
  const Landmarks& shape_;
};

TEST_P(NoiseContract, ChannelsAreDescribedSoThatTheirPotentialsCanBeWritten) {
  in_each_dimension([](const Subject& s) {
    const std::vector<NoiseChannel> channels = s.noise->describe_channels(s.d, kCount);
    const Eigen::VectorXd h = s.noise->potentials(s.state);
    ASSERT_EQ(std::ssize(channels), h.size());
    for (Eigen::Index i = 0; i < h.size(); ++i)
      if (channels[i].noise.starts_with("linear"))  // it says no more
        EXPECT_EQ(channels[i].noise, s.noise->spec());
      else
        EXPECT_NEAR(DescribedChannel(channels[i], s.shape).potential(s.state), h[i], 1e-13 * (1 + std::abs(h[i])))
            << "channel " << i << " of " << channels[i].noise;
  });
}

std::vector<std::vector<int>> landmarks_of(const std::vector<NoiseChannel>& channels) {
  std::vector<std::vector<int>> all;
  for (const NoiseChannel& channel : channels) all.push_back(channel.landmarks);
  return all;
}

TEST(ChannelDescriptions, NamePairsByTheirSecondLandmark) {
  EXPECT_THAT(landmarks_of(make_noise("potential:beta=1,gamma=1")->describe_channels(2, 4)),
              ElementsAre(ElementsAre(0, 1), ElementsAre(0, 2), ElementsAre(1, 2), ElementsAre(0, 3), ElementsAre(1, 3),
                          ElementsAre(2, 3)));
}

TEST(ChannelDescriptions, OfASumNameTheirTermAndLeaveOutWhatDoesNotApply) {
  const auto channels = make_noise("ch-sd:beta=1,on=2+trouve-vialard:sigma=3,common=1")->describe_channels(1, 3);
  ASSERT_EQ(channels.size(), 2U);
  EXPECT_EQ(channels[0].noise, "ch-sd:beta=1,on=2");
  EXPECT_THAT(channels[0].landmarks, ElementsAre(1));
  EXPECT_EQ(channels[1].noise, "trouve-vialard:sigma=3,common=1");
  EXPECT_THAT(channels[1].landmarks, IsEmpty());
  EXPECT_EQ(channels[1].axis, 0);
  EXPECT_EQ(channels[1].center.size(), 0);
}

}  // namespace
}  // namespace pulson
