// Lines of a log that differ in their numbers alone, read straight into arrays.
//
// Theory. Who writes many inserts of one object writes the same text again and again, but for t, x
// and y. So the first line of a block, known to be an insert, is cut at its numbers, and each line
// that has the same pieces with numbers between them is an insert of the same object:
//
//      {"op":"insert","t":12.5,"object":"hull","x":1.0,"y":2.0}
//      [     piece 0     ]  t [     piece 1      ] x [  2 ] y [3]
//
// A number is w / 10^k. With w < 10^19 and k <= 22 the one is a sum of two doubles and the other is
// a double; their quotient is found to 2^-104 of its magnitude and rounded to nearest, unless it
// lies too close to the middle between two doubles to tell.
//
// Refuses, by returning nothing, whatever is not as said: other lines, long numbers, what is no
// JSON. Others then find out what it is.
// Cost: O(bytes), 1 ns each.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include "predicates.hpp"

namespace flintknap {

// Reads a JSON number at p and moves p behind it. False if there is none, or one that is too long
// or too close to a tie.
inline bool read_number(const char*& p, const char* end, double& value) {
    static constexpr double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                        1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                        1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    auto is_digit = [&] { return p != end && '0' <= *p && *p <= '9'; };
    auto is = [&](char c) { return p != end && *p == c; };
    std::uint64_t w = 0;
    auto digits = [&] {
        const char* first = p;
        for (; is_digit(); ++p) w = 10 * w + static_cast<std::uint64_t>(*p - '0');
        return p - first;
    };
    bool is_negative = is('-');
    p += is_negative;
    bool starts_with_zero = is('0');
    std::ptrdiff_t whole = digits(), fraction = 0, zeros = starts_with_zero, exponent = 0;
    if (whole == 0 || (starts_with_zero && whole > 1)) return false;
    if (is('.')) {
        ++p;
        const char* first = p;
        while (starts_with_zero && is('0')) ++p;
        zeros += p - first;
        digits();
        fraction = p - first;
        if (fraction == 0) return false;
    }
    if (whole + fraction - zeros > 19) return false;
    bool is_integer = fraction == 0 && !is('e') && !is('E');
    if (is('e') || is('E')) {
        ++p;
        bool is_below = is('-');
        p += is_below || is('+');
        const char* first = p;
        for (; is_digit() && p - first < 4; ++p) exponent = 10 * exponent + (*p - '0');
        if (p == first || is_digit()) return false;
        if (is_below) exponent = -exponent;
    }
    std::ptrdiff_t k = fraction - exponent;
    if (k < 0 || k > 22) return false;
    double high = static_cast<double>(w), power = powers[k];
    double low =
        static_cast<double>(static_cast<std::int64_t>(w - static_cast<std::uint64_t>(high)));
    double q = high / power;
    Pair back = two_product(q, power);
    double correction = (((high - back.high) - back.low) + low) / power;
    // two roundings of 2^-53 of the correction; that of the remainder is exact
    double slack = 4 * kUlp * std::fabs(correction);
    double least = q + (correction - slack), most = q + (correction + slack);
    value = is_negative && !(is_integer && w == 0) ? -least : least;  // no integer is -0.0
    return least == most;
}

// A line that inserts a point, cut at its numbers: what other lines are compared with.
class Pattern {
   public:
    explicit Pattern(std::string_view line) {
        std::size_t from = 0;
        char name = 0;  // of the field whose number may follow, if it has one letter
        for (std::size_t i = 0; i < line.size(); ++i) {
            if (line[i] == '"') {
                std::size_t begin = ++i;
                while (i < line.size() && line[i] != '"') i += line[i] == '\\' ? 2 : 1;
                name = i == begin + 1 ? line[begin] : '\0';
            } else if (line[i] == '-' || ('0' <= line[i] && line[i] <= '9')) {
                std::size_t column = std::string_view("txy").find(name);
                if (numbers_ == kNumbers || column == std::string_view::npos) {
                    numbers_ = 0;
                    return;
                }
                columns_[numbers_] = column;
                pieces_[numbers_++] = line.substr(from, i - from);
                from = std::min(line.find_first_not_of("+-.eE0123456789", i), line.size());
                i = from - 1;
            }
        }
        pieces_[kNumbers] = line.substr(from);
    }

    // t of all lines, then x, then y; nothing if some line is another.
    std::vector<double> read(std::string_view lines) const {
        std::array<std::size_t, kNumbers> sorted = columns_;
        std::sort(sorted.begin(), sorted.end());
        if (numbers_ < kNumbers || sorted != std::array<std::size_t, kNumbers>{0, 1, 2}) return {};
        auto count = static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n')) + 1;
        std::vector<double> values(kNumbers * count);
        const char *p = lines.data(), *end = p + lines.size();
        auto passes = [&](std::string_view piece) {
            if (static_cast<std::size_t>(end - p) < piece.size()) return false;
            bool is_equal = std::memcmp(p, piece.data(), piece.size()) == 0;
            p += piece.size();
            return is_equal;
        };
        for (std::size_t row = 0; row < count; ++row) {
            if (row > 0 && !passes("\n")) return {};
            for (std::size_t i = 0; i < kNumbers; ++i) {
                double& value = values[columns_[i] * count + row];
                if (!passes(pieces_[i]) || !read_number(p, end, value)) return {};
            }
            if (!passes(pieces_[kNumbers])) return {};
        }
        if (p != end) return {};
        return values;
    }

   private:
    static constexpr std::size_t kNumbers = 3;

    std::array<std::string_view, kNumbers + 1> pieces_;
    std::array<std::size_t, kNumbers> columns_{};  // of the number behind a piece
    std::size_t numbers_ = 0;
};

}  // namespace flintknap
