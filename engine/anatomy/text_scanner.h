#pragma once
/// A text mesh taken apart into words and numbers, with the line of each for messages.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace anatomy {

class TextScanner {
public:
    /// Keeps a reference to the text of the whole file, of which the part between two bytes is read.
    TextScanner(std::string_view text, std::string file, std::size_t from = 0,
                std::size_t to = std::string_view::npos)
        : text_(text.substr(0, to)), file_(std::move(file)), at_(from), last_(from) {}

    /// The next word, or an empty one at the end of the text. A comment runs from '#' to the end of its line
    /// where they are allowed.
    std::string_view word();
    /// The rest of the current line.
    std::string_view rest_of_line();
    /// Whether the next word is this one, in upper or lower case; it is then taken.
    bool take(std::string_view expected);
    /// The next word as a finite number, or as a whole one within limits; `what` says what it is.
    double number(std::string_view what);
    std::int64_t whole(std::string_view what, std::int64_t least, std::int64_t most);
    /// The next bytes, whatever they are.
    std::string_view bytes(std::string_view what, std::size_t count);
    std::size_t left() const { return text_.size() - at_; }  // [bytes]
    bool at_end();

    /// Throws InputError "FILE:LINE: 'WORD' was found; expected EXPECTED" for the word last taken.
    [[noreturn]] void refuse(std::string_view expected) const;
    /// The same with another finding.
    [[noreturn]] void refuse_found(const std::string& found, std::string_view expected) const;

    bool comments = false;

private:
    void skip_space();

    std::string_view text_;
    std::string file_;
    std::size_t at_, last_;  // the next byte, and the start of the word last taken
};

/// Whether two words are equal but for upper and lower case.
bool same_word(std::string_view, std::string_view);
/// The extension of a file's name with its dot, in lower case.
std::string extension_of(const std::filesystem::path&);

}  // namespace anatomy
