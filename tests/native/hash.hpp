// The bits of results, as one number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace native {

// FNV-1a, 64 bits, over the bytes of arrays.
class Hash {
public:
    template <class T>
    void add(const T* values, std::size_t count) {
        const auto* bytes = reinterpret_cast<const unsigned char*>(values);
        for (std::size_t i = 0; i < count * sizeof(T); ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
    }
    template <class T>
    void add(const std::vector<T>& values) {
        add(values.data(), values.size());
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

// Prints a line for each case; remembers whether threads made a difference.
class Cases {
public:
    // `compute` takes the number of threads and returns the hash of what it made.
    template <class Compute>
    void run(const std::string& name, const Compute& compute) {
        const std::uint64_t alone = compute(1), together = compute(most_threads_);
        std::printf("%-60s %016llx\n", name.c_str(), static_cast<unsigned long long>(alone));
        if (alone == together) return;
        std::fprintf(stderr, "%s: threads change the result\n", name.c_str());
        has_failed_ = true;
    }
    // Fails unless something holds.
    void hold(const std::string& name, bool is_so) {
        if (is_so) return;
        std::fprintf(stderr, "%s: does not hold\n", name.c_str());
        has_failed_ = true;
    }
    bool has_failed() const { return has_failed_; }

private:
    static constexpr int most_threads_ = 3;
    bool has_failed_ = false;
};

template <class T>
constexpr const char* name_of_scalar = sizeof(T) == 4 ? "float" : "double";

// Each runs its cases in both scalars.
void run_gaussian_cases(Cases& cases);
void run_stroke_cases(Cases& cases);
void run_box_cases(Cases& cases);
void run_plane_cases(Cases& cases);
void run_view_cases(Cases& cases);

}  // namespace native
