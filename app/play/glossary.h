#pragma once
/// The manual's glossary (docs/glossary.md), for the words on the room's screen.

#include <string>
#include <string_view>
#include <vector>

namespace app {

/// A word of the glossary in a text: bytes [begin, end), and what it means.
struct GlossaryWord {
    std::size_t begin, end;
    std::string_view name, meaning;
};

/// All words of the glossary in the text, whole words in any case, the longest where several fit; in order.
std::vector<GlossaryWord> glossary_words(std::string_view text);

}  // namespace app
