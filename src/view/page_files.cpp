#include "page_files.hpp"

#include <algorithm>
#include <array>

#include "view_page.hpp"

namespace pulson::view {

const PageFile* page_file(std::string_view name) {
  constexpr std::string_view kScript = "text/javascript; charset=utf-8", kStyle = "text/css; charset=utf-8";
  using namespace view_page;
  static constexpr std::array kFiles = {PageFile{"", "text/html; charset=utf-8", index_html},
                                        PageFile{"view.css", kStyle, view_css},
                                        PageFile{"icon.svg", "image/svg+xml", icon_svg},
                                        PageFile{"main.js", kScript, main_js},
                                        PageFile{"api.js", kScript, api_js},
                                        PageFile{"keys.js", kScript, keys_js},
                                        PageFile{"tools.js", kScript, tools_js},
                                        PageFile{"geometry.js", kScript, geometry_js},
                                        PageFile{"state.js", kScript, state_js},
                                        PageFile{"actions.js", kScript, actions_js},
                                        PageFile{"saving.js", kScript, saving_js},
                                        PageFile{"photo.js", kScript, photo_js},
                                        PageFile{"marks.js", kScript, marks_js},
                                        PageFile{"panels.js", kScript, panels_js},
                                        PageFile{"result.js", kScript, result_js},
                                        PageFile{"warp.js", kScript, warp_js}};
  const auto found =
      std::find_if(kFiles.begin(), kFiles.end(), [&](const PageFile& file) { return file.name == name; });
  return found == kFiles.end() ? nullptr : &*found;
}

}  // namespace pulson::view
