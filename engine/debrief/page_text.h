#pragma once
/// What every page carries: how it looks, and what its marks and time line do when they are clicked.

namespace debrief {

extern const char* const page_style;   // CSS
extern const char* const page_script;  // JavaScript; reads the element "data"

}  // namespace debrief
