#pragma once

// The state of `pulson view`: one document, all of which is in NAME.pulson.json.

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "opened_shape.hpp"

namespace pulson::view {

/// What is known of a landmark on one picture.
enum class Placement : std::uint8_t {
  kNone,     ///< not yet placed
  kPlaced,   ///< it has a position
  kMissing,  ///< it cannot be seen
  kAbsent,   ///< the specimen does not have it
};

struct PlacedLandmark {
  Placement placement = Placement::kNone;
  Eigen::Vector2d position{0, 0};  ///< of the picture as displayed: pixels, the centre of the first is (0, 0), y down
};

struct ViewSpecimen {
  std::string name;
  std::string picture;  ///< path of the file, from the folder of the document; empty: none
  int width = 0;        ///< as displayed, pixels
  int height = 0;
  std::vector<PlacedLandmark> landmarks{};    ///< as many as landmarks
  std::vector<PlacedLandmark> second_pass{};  ///< digitised again; empty, or as many
  std::string shape{};  ///< address of the shape that was opened, `file.tps#3`, one of ViewDocument::shapes; or empty
};

struct ViewLandmark {
  std::string name;   ///< may be empty
  std::string group;  ///< may be empty
};

struct ViewDocument {
  std::int64_t revision = 0;  ///< rises with each change
  std::vector<ViewSpecimen> specimens;
  std::vector<ViewLandmark> landmarks;
  std::vector<std::pair<int, int>> links;       ///< of the wireframe, landmarks from 0
  std::array<int, 2> shown{0, 1};               ///< specimens on the left and on the right
  std::string opened{};                         ///< the landmark file that was opened, from the folder of the document
  std::vector<std::string> exported{};          ///< names of files that this document was exported to
  std::map<std::string, OpenedShape> shapes{};  ///< that were opened, by their addresses
};

/// @throws InputError "NAME: place problem" where it is none, or where a specimen's shape is none of `shapes`
ViewDocument document_of_json(const std::string& name, std::string_view text);
/// A document as the page sends it, which has not got the shapes that were opened: they are `shapes`.
ViewDocument document_of_page(std::string_view text, const std::map<std::string, OpenedShape>& shapes);

std::string json_of_document(const ViewDocument& document);

}  // namespace pulson::view
