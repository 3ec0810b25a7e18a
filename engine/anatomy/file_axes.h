#pragma once
/// Which axes the numbers of a file have, by its own word. 3D Slicer writes SPACE=RAS or SPACE=LPS into the
/// models that it saves.

#include <optional>
#include <string>
#include <string_view>

#include "physics/geometry/state.h"

namespace anatomy {

/// What a file states of its axes.
struct StatedAxes {
    std::string axes;   // "lps", "ras", or another word, as the file has it
    std::string where;  // "the header says SPACE=RAS"
    void state(geometry::StateStream& s) { s(axes, where); }
};

/// The first SPACE=WORD of a line of text, in any case, such as "3D Slicer output. SPACE=RAS".
std::optional<StatedAxes> axes_in_line(std::string_view line, std::string_view place);
/// The same for a word alone, which the file gives in another way, as a coordinate system.
StatedAxes axes_named(std::string_view word, std::string where);

/// The axes to take a file's numbers in, and why.
struct TakenAxes {
    std::string axes;   // "lps" or "ras"
    std::string why;    // "the header says SPACE=RAS"
    bool known = true;  // by the file or by whom asks
};

/// Those that the file states, else those `given` by `asked` ("--axes ras"), else `otherwise`. Throws
/// InputError where a file states others than are given, or such as are not known.
TakenAxes taken_axes(const std::string& file, const std::optional<StatedAxes>& stated,
                     const std::string& given, const std::string& asked,
                     const std::string& otherwise = "lps");

}  // namespace anatomy
