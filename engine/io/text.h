#pragma once
/// Conversion of numbers and words to text and back, the same in every locale; and how deep texts may be
/// nested, for what reads them calls itself level by level. Fractions of a piece of work, "2/5".

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "physics/geometry/vec.h"

namespace io {

/// Shortest text that reads back to the same bits.
std::string number_text(double);

/// Rounded to so many significant digits and without an exponent: "250", "0.0042"; less than 1e-6 is "0".
std::string rounded_text(double, int digits = 2);

/// The whole word as a number; empty for anything else. Accepts "nan" and "inf": callers must check for them.
std::optional<double> parse_number(std::string_view);
std::optional<int> parse_integer(std::string_view);

/// Sixteen lower-case hexadecimal digits and back.
std::string hash_text(std::uint64_t);
std::optional<std::uint64_t> parse_hash(std::string_view);

/// Whether all of it is whole characters of UTF-8, and the text with "\uFFFD" in place of each byte that is
/// not.
bool is_utf8(std::string_view);
std::string as_utf8(std::string_view);

/// The text with "?" in place of each control character but the end of a line: what a file says must not act
/// on the terminal that shows it.
std::string without_control(std::string_view);

/// The text as HTML shows it, in content and in attributes; spaces stand for control characters.
std::string html_escaped(std::string_view);

/// The text as a string of TOML, in quotes, and as a key: in quotes where it needs them.
std::string toml_text(std::string_view);
std::string toml_key(std::string_view);

/// Without blanks and ends of lines around it.
std::string_view trimmed(std::string_view);

/// The text with a to z in place of A to Z.
std::string lower_case(std::string_view);

/// The text as a part of a file's name, unlike that of any other text: what some file systems or shells do
/// not take in a name, and a dot at the start, is written as %XX.
std::string file_name_of(std::string_view);

/// "(1.00, 2.00, 3.00)", for messages [mm].
std::string place_text(const geometry::Vec3&);

/// The accepted word nearest to the one written, empty when none is near.
std::string nearest_word(std::string_view written, std::span<const std::string_view> accepted);

/// " (did you mean 'word'?)", or two that are as near, to follow the word written; empty when no accepted
/// word is near.
std::string suggestion(std::string_view written, std::span<const std::string_view> accepted);

/// The parts between separators; empty ones count.
std::vector<std::string_view> split(std::string_view text, char separator);
/// The words between blanks.
std::vector<std::string_view> words_of(std::string_view text);

/// "a, b, c".
std::string joined(std::span<const std::string_view> words, std::string_view separator = ", ");
std::string joined(const std::vector<std::string>& words, std::string_view separator = ", ");

inline constexpr int deepest_nesting = 64;

/// Throws InputError "FILE:LINE: …" for JSON with brackets nested deeper.
void check_json_depth(std::string_view text, const std::string& file);
/// The same for TOML; a dotted key counts a level for each of its dots.
void check_toml_depth(std::string_view text, const std::string& file);

inline constexpr int most_shards = 100'000;

/// The `index`-th of `count` equal fractions, counted from 1.
struct Shard {
    int index = 1, count = 1;
};

/// "i/n", 1 ≤ i ≤ n ≤ most_shards. Throws InputError, which names the option --shard.
Shard parse_shard(std::string_view);

}  // namespace io
