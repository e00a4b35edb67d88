#include "noise_channels.hpp"

#include <vector>

namespace pulson::records {

namespace {

formats::Json landmark_json(const Landmarks& source, const std::vector<int>& landmarks) {
  if (landmarks.size() == 1) return source.number(landmarks.front());
  formats::Json numbers = formats::Json::array();
  for (const int a : landmarks) numbers.push_back(source.number(a));
  return numbers;
}

formats::Json channel_json(const Landmarks& source, const NoiseChannel& channel) {
  formats::Json json = {{"noise", channel.noise}};
  if (!channel.landmarks.empty()) json["landmark"] = landmark_json(source, channel.landmarks);
  if (channel.axis) json["axis"] = *channel.axis + 1;
  if (channel.center.size() > 0) json["center"] = channel.center;
  if (channel.wavevector.size() > 0) json["wavevector"] = channel.wavevector;
  return json;
}

}  // namespace

formats::Json channels_json(const matching::Registration& registration) {
  const Landmarks& source = registration.source;
  const std::shared_ptr<const NoiseModel> noise = registration_noise(registration);
  formats::Json json = formats::Json::array();
  for (const NoiseChannel& channel : noise->describe_channels(source.dimension(), source.count()))
    json.push_back(channel_json(source, channel));
  return json;
}

}  // namespace pulson::records
