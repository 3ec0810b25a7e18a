#pragma once
/// Do the walls of a simulation distinguish inside from outside, and which segments cross them?

#include <string_view>

#include "engine/studies/study.h"

namespace studies {

/// One row per mesh (as generated, turned inside out, with 5 % of its triangles turned) and wall. The truth
/// is the sign of the implicit surface, at random places more than 0.1 mm from it. Crossings count random
/// segments of 1 and 2 mm with both ends inside that lie more than 0.1 mm outside in between.
io::Table sign_table();
void add_signs(io::Table&, std::string_view preset, const StudyOptions&);

/// What the table's columns mean, for the page.
std::string sign_text();

}  // namespace studies
