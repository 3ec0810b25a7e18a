#pragma once
/// What clinicians call the vessels that files and scripts abbreviate. The one table of these names.

#include <string>
#include <string_view>

namespace anatomy {

/// "left renal artery" for "LRA"; "aorta to left common femoral artery" for "aorta+LCIA+LEIA+LCFA", as
/// vessels are called that run on through several; a name that is no abbreviation is its own.
std::string clinical_name(std::string_view branch);
/// Of an open end: "left common femoral artery" for "aorta+LCIA+LEIA+LCFA.out", "aorta" for its ".in".
std::string clinical_end(std::string_view end);

}  // namespace anatomy
