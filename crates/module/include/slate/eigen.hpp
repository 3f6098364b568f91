/// @file
/// Views of values as vectors and matrices of Eigen, without a copy. It needs Eigen 3.

#pragma once

#include <Eigen/Core>

#include "values.hpp"

namespace slate::eigen {

/// Vector of `N` numbers in memory of a value.
template <typename T, int N>
using VectorView = Eigen::Map<std::conditional_t<std::is_const_v<T>, const Eigen::Matrix<std::remove_const_t<T>, N, 1>, Eigen::Matrix<T, N, 1>>>;

/// Matrix in memory of a value, row by row as in ROS.
template <typename T, int Rows, int Columns>
using MatrixView = Eigen::Map<std::conditional_t<std::is_const_v<T>, const Eigen::Matrix<std::remove_const_t<T>, Rows, Columns, Eigen::RowMajor>,
                                                 Eigen::Matrix<T, Rows, Columns, Eigen::RowMajor>>>;

/// Returns an array as a vector.
template <typename T, std::size_t N>
VectorView<T, static_cast<int>(N)> vector(std::array<T, N> &values) {
    return VectorView<T, static_cast<int>(N)>(values.data());
}
template <typename T, std::size_t N>
VectorView<const T, static_cast<int>(N)> vector(const std::array<T, N> &values) {
    return VectorView<const T, static_cast<int>(N)>(values.data());
}

/// Returns the items of a sequence as a vector.
template <typename T, std::size_t N>
VectorView<T, Eigen::Dynamic> vector(Sequence<T, N> &values) {
    return {values.data(), static_cast<Eigen::Index>(values.size())};
}
template <typename T, std::size_t N>
VectorView<const T, Eigen::Dynamic> vector(const Sequence<T, N> &values) {
    return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// Returns the items of a tail as a vector.
template <typename T>
VectorView<T, Eigen::Dynamic> vector(Span<T> values) {
    return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// Returns an array as a matrix, row by row: `matrix<3, 3>(pose->covariance)`.
template <int Rows, int Columns, typename T, std::size_t N>
MatrixView<T, Rows, Columns> matrix(std::array<T, N> &values) {
    static_assert(N == static_cast<std::size_t>(Rows * Columns), "the matrix has as many elements as the array");
    return MatrixView<T, Rows, Columns>(values.data());
}
template <int Rows, int Columns, typename T, std::size_t N>
MatrixView<const T, Rows, Columns> matrix(const std::array<T, N> &values) {
    static_assert(N == static_cast<std::size_t>(Rows * Columns), "the matrix has as many elements as the array");
    return MatrixView<const T, Rows, Columns>(values.data());
}

} // namespace slate::eigen
