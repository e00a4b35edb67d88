#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "html/html_report.hpp"

namespace pulson {

/// "0.1235"; "–" where the value is not finite.
std::string report_number(double value, int digits = 4);

/// "1e8", "0.25": four digits, and a short exponent.
std::string short_number(double value);

/// "conserved to 2e-15", or "conserved exactly" where the error is 0.
std::string conservation(double error);

/// "one triangle", "no triangles", "3 triangles"
std::string count_in_words(std::int64_t count, const std::string& one, const std::string& several);

/// What a title calls the start of paths: its name, or where it is from numbers on the command line "2 landmarks".
std::string start_name(const Landmarks& shape);

/// Where paths start, for a table of settings: the file, or the option and up to six of its numbers: `--q 0, 10`.
std::string start_text(const Landmarks& shape);

/// The head of a table of landmarks: number, and label and group where the shape has them.
html::ReportTable landmark_table(const Landmarks& shape);
/// The cells of landmark a below that head.
std::vector<html::ReportCell> landmark_cells(const Landmarks& shape, int a);
/// The landmarks that a table lists: all, or of more than 1000 those with the largest values, in their order. Values
/// that are NaN are the smallest.
std::vector<int> listed_landmarks(const Eigen::VectorXd& values);

/// A report with the command line and version, and with warnings and notes as remarks.
html::HtmlReport new_report(std::string title, std::string lead, const std::vector<std::string>& warnings,
                            const std::vector<std::string>& notes);

/// The picture as a section, unless its name is empty.
void add_still(html::HtmlReport& report, const std::string& heading, const std::filesystem::path& picture,
               bool has_photograph = false);

/// Which of the places 0 to `last` of a path a motion shows: the first and the last and, evenly, no more than 41 in
/// all; fewer, but at least five, where the motion has many numbers for each.
std::vector<int> shown_frames(int last, std::int64_t numbers);

/// Whether all places are small enough to be drawn.
bool can_be_drawn(const std::vector<Points>& frames);

}  // namespace pulson
