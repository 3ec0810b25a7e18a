#pragma once
/// What Emscripten 3.1's C++ library (libc++ 13) lacks of C++20, as far as this program uses it. Read before
/// every file. With libc++ 16 or later nothing of it is left.

// Eigen's SSE2 code, which browsers have as SIMD with the same results to the bit, without its inline
// assembly: that only tells compilers of other processors what to keep in registers.
#define EIGEN_OPTIMIZATION_BARRIER(X)
#define __asm__(...)
#include <Eigen/Core>
#undef __asm__

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <compare>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fmt/core.h>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

#if _LIBCPP_VERSION < 14000
namespace std {

template <class To, class From>
To bit_cast(const From& from) noexcept {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    std::memcpy(&to, &from, sizeof(To));
    return to;
}

template <class T>
unique_ptr<T> make_unique_for_overwrite(size_t count) {
    return unique_ptr<T>(new remove_extent_t<T>[count]);
}

template <class T, size_t N>
constexpr auto operator<=>(const array<T, N>& a, const array<T, N>& b) {
    for (size_t k = 0; k < N; ++k)
        if (const auto order = a[k] <=> b[k]; order != 0) return order;
    return decltype(a[0] <=> b[0])::equal;
}

inline from_chars_result from_chars(const char* first, const char* last, double& value) {
    // As strtod, but without spaces, a plus and hexadecimal numbers before it.
    const string text(first, last);
    const size_t digit = text[0] == '-' ? 1 : 0;
    const bool is_hex = text.size() > digit + 1 && text[digit] == '0' && (text[digit + 1] | 32) == 'x';
    if (text.empty() || (text[digit] != '.' && !isalnum(static_cast<unsigned char>(text[digit]))))
        return {first, errc::invalid_argument};
    if (is_hex) {
        value = digit == 1 ? -0.0 : 0.0;
        return {first + digit + 1, errc{}};
    }
    char* end = nullptr;
    errno = 0;
    const double read = strtod(text.c_str(), &end);
    if (end == text.c_str()) return {first, errc::invalid_argument};
    if (errno == ERANGE) return {first + (end - text.c_str()), errc::result_out_of_range};
    value = read;
    return {first + (end - text.c_str()), errc{}};
}

inline to_chars_result chars_of(const string& text, char* first, char* last) {
    if (last - first < static_cast<ptrdiff_t>(text.size())) return {last, errc::value_too_large};
    return {std::copy(text.begin(), text.end(), first), errc{}};
}
inline to_chars_result to_chars(char* first, char* last, double value, chars_format format, int digits) {
    char text[400];
    const char* const as = format == chars_format::fixed        ? "%.*f"
                           : format == chars_format::scientific ? "%.*e"
                                                                : "%.*g";
    std::snprintf(text, sizeof(text), as, digits, value);
    return chars_of(text, first, last);
}
/// The shortest digits that are read back as this number, in the shorter of both notations.
inline to_chars_result to_chars(char* first, char* last, double value) {
    if (value != value || value - value != 0)
        return chars_of(value != value ? "nan" : value > 0 ? "inf" : "-inf", first, last);
    const string shown = fmt::format("{}", value);
    string digits, sign = shown[0] == '-' ? "-" : "";
    int point = 0;  // digits before it
    const size_t e = shown.find('e'), dot = shown.find('.');
    for (size_t k = sign.size(); k < std::min(e, shown.size()); ++k)
        if (shown[k] != '.') digits += shown[k];
    point = static_cast<int>(std::min({dot, e, shown.size()}) - sign.size());
    if (e != string::npos) point += atoi(shown.c_str() + e + 1);
    while (digits.size() > 1 && digits[0] == '0') digits.erase(0, 1), --point;
    while (digits.size() > 1 && digits.back() == '0') digits.pop_back();
    if (digits == "0") return chars_of(sign + "0", first, last);
    const int count = static_cast<int>(digits.size());
    string fixed = point <= 0       ? "0." + string(static_cast<size_t>(-point), '0') + digits
                   : point >= count ? digits + string(static_cast<size_t>(point - count), '0')
                                    : digits.substr(0, static_cast<size_t>(point)) + "." +
                                          digits.substr(static_cast<size_t>(point));
    const int exponent = point - 1;
    string scientific = digits.substr(0, 1) + (count > 1 ? "." + digits.substr(1) : "") + "e" +
                        (exponent < 0 ? "-" : "+") + (std::abs(exponent) < 10 ? "0" : "") +
                        to_string(std::abs(exponent));
    // A large whole number is written with all its digits, which are more than those that tell it apart.
    if (point > count && fixed.size() <= scientific.size()) {
        char text[400];
        std::snprintf(text, sizeof(text), "%.0f", std::abs(value));
        fixed = text;
    }
    return chars_of(sign + (fixed.size() <= scientific.size() ? fixed : scientific), first, last);
}

/// Browsers give this program one thread: work that would be shared is done by who asks.
class jthread {
public:
    jthread() = default;
    template <class F, class... Arguments>
    explicit jthread(F&&, Arguments&&...) {
        throw system_error(make_error_code(errc::resource_unavailable_try_again));
    }
};

namespace ranges {

namespace detail {
struct Same {
    template <class T>
    constexpr T&& operator()(T&& x) const noexcept {
        return static_cast<T&&>(x);
    }
};
template <class Compare, class Projection>
auto by(Compare& compare, Projection& projection) {
    return [&](const auto& a, const auto& b) -> bool {
        return std::invoke(compare, std::invoke(projection, a), std::invoke(projection, b));
    };
}
}  // namespace detail

template <class R, class T, class P = detail::Same>
auto find(R&& range, const T& value, P projection = {}) {
    return std::find_if(std::begin(range), std::end(range),
                        [&](const auto& x) { return std::invoke(projection, x) == value; });
}
template <class R, class F, class P = detail::Same>
auto find_if(R&& range, F is, P projection = {}) {
    return std::find_if(std::begin(range), std::end(range),
                        [&](const auto& x) -> bool { return std::invoke(is, std::invoke(projection, x)); });
}
template <class R, class F, class P = detail::Same>
bool any_of(R&& range, F is, P projection = {}) {
    return std::any_of(std::begin(range), std::end(range),
                       [&](const auto& x) -> bool { return std::invoke(is, std::invoke(projection, x)); });
}
template <class R, class F, class P = detail::Same>
bool all_of(R&& range, F is, P projection = {}) {
    return std::all_of(std::begin(range), std::end(range),
                       [&](const auto& x) -> bool { return std::invoke(is, std::invoke(projection, x)); });
}
template <class R, class F, class P = detail::Same>
bool none_of(R&& range, F is, P projection = {}) {
    return !ranges::any_of(range, is, projection);
}
template <class R, class T, class P = detail::Same>
auto count(R&& range, const T& value, P projection = {}) {
    return std::count_if(std::begin(range), std::end(range),
                         [&](const auto& x) { return std::invoke(projection, x) == value; });
}
template <class R, class F, class P = detail::Same>
auto count_if(R&& range, F is, P projection = {}) {
    return std::count_if(std::begin(range), std::end(range),
                         [&](const auto& x) -> bool { return std::invoke(is, std::invoke(projection, x)); });
}
template <class R, class C = less, class P = detail::Same>
void sort(R&& range, C compare = {}, P projection = {}) {
    std::sort(std::begin(range), std::end(range), detail::by(compare, projection));
}
template <class R, class C = less, class P = detail::Same>
void stable_sort(R&& range, C compare = {}, P projection = {}) {
    std::stable_sort(std::begin(range), std::end(range), detail::by(compare, projection));
}
template <class R, class C = less, class P = detail::Same>
bool is_sorted(R&& range, C compare = {}, P projection = {}) {
    return std::is_sorted(std::begin(range), std::end(range), detail::by(compare, projection));
}
template <class R, class C = less, class P = detail::Same>
auto max_element(R&& range, C compare = {}, P projection = {}) {
    return std::max_element(std::begin(range), std::end(range), detail::by(compare, projection));
}
template <class R, class C = less, class P = detail::Same>
auto min_element(R&& range, C compare = {}, P projection = {}) {
    return std::min_element(std::begin(range), std::end(range), detail::by(compare, projection));
}
template <class R, class C = less, class P = detail::Same>
auto min(R&& range, C compare = {}, P projection = {}) {
    return *ranges::min_element(range, compare, projection);
}
template <class R, class C = less, class P = detail::Same>
auto max(R&& range, C compare = {}, P projection = {}) {
    return *ranges::max_element(range, compare, projection);
}
template <class T>
struct minmax_result {
    T min, max;
};
template <class R>
auto minmax(R&& range) {
    const auto [low, high] = std::minmax_element(std::begin(range), std::end(range));
    return minmax_result<remove_cv_t<remove_reference_t<decltype(*low)>>>{*low, *high};
}
template <class R, class O>
O move(R&& range, O to) {
    return std::move(std::begin(range), std::end(range), to);
}
template <class A, class B, class O>
O set_union(A&& a, B&& b, O to) {
    return std::set_union(std::begin(a), std::end(a), std::begin(b), std::end(b), to);
}
template <class R, class I, class C = less, class P = detail::Same>
void nth_element(R&& range, I nth, C compare = {}, P projection = {}) {
    std::nth_element(std::begin(range), nth, std::end(range), detail::by(compare, projection));
}
template <class R, class T, class C = less, class P = detail::Same>
auto lower_bound(R&& range, const T& value, C compare = {}, P projection = {}) {
    return std::lower_bound(std::begin(range), std::end(range), value,
                            [&](const auto& x, const T& y) -> bool {
                                return std::invoke(compare, std::invoke(projection, x), y);
                            });
}
template <class R, class T, class C = less, class P = detail::Same>
auto upper_bound(R&& range, const T& value, C compare = {}, P projection = {}) {
    return std::upper_bound(std::begin(range), std::end(range), value,
                            [&](const T& y, const auto& x) -> bool {
                                return std::invoke(compare, y, std::invoke(projection, x));
                            });
}
template <class R, class T, class C = less, class P = detail::Same>
bool binary_search(R&& range, const T& value, C compare = {}, P projection = {}) {
    const auto at = ranges::lower_bound(range, value, compare, projection);
    return at != std::end(range) && !std::invoke(compare, value, std::invoke(projection, *at));
}
template <class R>
void reverse(R&& range) {
    std::reverse(std::begin(range), std::end(range));
}
template <class R, class T>
void fill(R&& range, const T& value) {
    std::fill(std::begin(range), std::end(range), value);
}
template <class R, class T>
void replace(R&& range, const T& from, const T& to) {
    std::replace(std::begin(range), std::end(range), from, to);
}
template <class R, class Out>
auto copy(R&& range, Out to) {
    return std::copy(std::begin(range), std::end(range), to);
}
template <class R, class Out, class F>
auto transform(R&& range, Out to, F change) {
    return std::transform(std::begin(range), std::end(range), to,
                          [&](const auto& x) -> decltype(auto) { return std::invoke(change, x); });
}
template <class A, class B>
bool equal(const A& a, const B& b) {
    return std::equal(std::begin(a), std::end(a), std::begin(b), std::end(b));
}

}  // namespace ranges
}  // namespace std
#endif
