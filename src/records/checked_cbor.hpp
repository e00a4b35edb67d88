#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/checksum.hpp"

namespace pulson::records {

/// A value that a file of ours cannot have.
struct Damaged {};

/// Goes through a binary text and stops where lists are nested deeper than those of our files: to make values of them
/// takes a stack as deep.
class DepthCheck : public nlohmann::json_sax<nlohmann::ordered_json> {
 public:
  explicit DepthCheck(int deepest) : deepest_(deepest) {}

  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t /*value*/) override { return true; }
  bool number_unsigned(number_unsigned_t /*value*/) override { return true; }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return true; }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return true; }
  bool key(string_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*elements*/) override { return ++depth_ <= deepest_; }
  bool start_array(std::size_t /*elements*/) override { return ++depth_ <= deepest_; }
  bool end_object() override { return depth_-- > 0; }
  bool end_array() override { return depth_-- > 0; }
  bool parse_error(std::size_t /*place*/, const std::string& /*token*/, const nlohmann::json::exception&) override {
    return false;
  }

 private:
  int deepest_;
  int depth_ = 0;
};

/// The value as a CBOR text that ends with its checksum.
inline std::string sealed_cbor(const nlohmann::ordered_json& json) {
  const std::vector<std::uint8_t> bytes = nlohmann::ordered_json::to_cbor(json);
  return sealed({bytes.begin(), bytes.end()});
}

/// The value of such a text whose lists are nested no deeper. @throws Damaged
inline nlohmann::ordered_json checked_cbor(std::string_view bytes, int deepest) {
  using Json = nlohmann::ordered_json;
  if (!unseal(bytes)) throw Damaged();
  DepthCheck check(deepest);
  if (!Json::sax_parse(bytes.begin(), bytes.end(), &check, Json::input_format_t::cbor)) throw Damaged();
  return Json::from_cbor(bytes.begin(), bytes.end());
}

}  // namespace pulson::records
