# Plots, in R's own graphics.

plot.pulson_registration <- function(x, grid = ncol(x$source) == 2, axes = 1:2, lines = 16, ...) {
  truth(grid, "grid")
  if (!is.numeric(lines) || length(lines) != 1 || !isTRUE(lines >= 2 && is.finite(lines)))
    raise("input_error", "lines: a number of lines, 2 or more, is needed")
  k <- ncol(x$source)
  if (k == 1) return(plot_line(x, ...))
  check_plot_axes(axes, k)
  source <- x$source[, axes, drop = FALSE]
  target <- x$target[, axes, drop = FALSE]
  end <- x$result[, axes, drop = FALSE]
  mesh <- if (grid && k == 2) warped_grid(x, lines)
  all <- rbind(target, end, if (!is.null(mesh)) mesh$points)
  plot(all, type = "n", asp = 1, xlab = axis_names(k)[axes[1]], ylab = axis_names(k)[axes[2]], ...)
  if (!is.null(mesh)) for (line in mesh$lines) graphics::lines(mesh$points[line, ], col = grey(0.75))
  aligned <- x$aligned[, axes, drop = FALSE]
  segments(aligned[, 1], aligned[, 2], end[, 1], end[, 2], col = grey(0.5))
  points(aligned, pch = 20, cex = 0.7, col = grey(0.5))
  points(target, pch = 1, cex = 1.3)
  points(end, pch = 20, col = 2)
  legend("topright", c("source, aligned", "target", "source, carried"), pch = c(20, 1, 20), col = c(grey(0.5), 1, 2),
         bty = "n", cex = 0.8)
  invisible(x)
}

plot_line <- function(x, ...) {
  end <- cbind(x$aligned[, 1], x$result[, 1])
  plot(range(end, x$target, na.rm = TRUE), c(0, 1), type = "n", yaxt = "n", xlab = "X", ylab = "", ...)
  axis(2, c(0, 1), c("source", "target"))
  segments(end[, 1], 0, end[, 2], 1, col = grey(0.5))
  points(end[, 1], rep(0, nrow(end)), pch = 20, col = grey(0.5))
  points(end[, 2], rep(1, nrow(end)), pch = 20, col = 2)
  points(x$target[, 1], rep(1, nrow(end)), pch = 1, cex = 1.3)
  invisible(x)
}

check_plot_axes <- function(axes, k) {
  if (length(axes) != 2 || !all(axes %in% seq_len(k)))
    raise("input_error", sprintf("axes: two numbers from 1 to %d are needed", k))
}

# Lines around the source, carried to the target by the map.
warped_grid <- function(registration, lines) {
  source <- registration$source
  low <- apply(source, 2, min, na.rm = TRUE)
  high <- apply(source, 2, max, na.rm = TRUE)
  step <- max(high - low) * 1.2 / (lines - 1)
  counts <- pmax(2, ceiling((high - low) * 1.2 / step) + 1)
  low <- (low + high) / 2 - step * (counts - 1) / 2
  fine <- 4
  coordinate <- function(axis, i) low[axis] + step * i
  parts <- list()
  for (j in seq_len(counts[2]) - 1)
    parts[[length(parts) + 1]] <- cbind(coordinate(1, seq(0, counts[1] - 1, by = 1 / fine)), coordinate(2, j))
  for (i in seq_len(counts[1]) - 1)
    parts[[length(parts) + 1]] <- cbind(coordinate(1, i), coordinate(2, seq(0, counts[2] - 1, by = 1 / fine)))
  ends <- cumsum(vapply(parts, nrow, 0L))
  list(points = suppressMessages(pulson_warp(registration, do.call(rbind, parts))),
       lines = Map(seq, c(1, utils::head(ends, -1) + 1), ends))
}

# The source, and where the flows take it, each alignment undone.
plot.pulson_cohort <- function(x, axes = 1:2, ...) {
  fits <- Filter(Negate(is.null), x$registrations)
  if (length(fits) == 0) raise("input_error", "x: none of its registrations has a result")
  ends <- lapply(fits, in_frame_of_source)
  source <- fits[[1]]$source
  k <- ncol(source)
  on_line <- k == 1
  if (on_line) {
    rows <- function(points, at) cbind(points[, 1], at)
    ends <- Map(rows, ends, seq_along(ends))
    source <- rows(source, 0)
    axes <- 1:2
  } else {
    check_plot_axes(axes, k)
  }
  all <- do.call(rbind, c(list(source), ends))[, axes]
  plot(all, type = "n", asp = if (on_line) NA else 1, xlab = axis_names(k)[axes[1]],
       ylab = if (on_line) "" else axis_names(k)[axes[2]], yaxt = if (on_line) "n" else "s", ...)
  if (on_line) axis(2, seq(0, length(ends)), c("source", names(fits)), las = 1, cex.axis = 0.7)
  colours <- grDevices::hcl.colors(length(ends), "Dark 3")
  for (i in seq_along(ends)) points(ends[[i]][, axes], pch = 20, col = colours[i])
  points(source[, axes], pch = 1, cex = 1.2)
  if (!on_line && length(ends) <= 12)
    legend("topright", c("source", names(fits)), pch = c(1, rep(20, length(ends))), col = c(1, colours), bty = "n",
           cex = 0.8)
  invisible(x)
}

in_frame_of_source <- function(fit) {
  map <- fit$record$alignment
  linear <- map$scale * matrix(unlist(map$linear), ncol(fit$result))
  t(solve(linear, t(fit$result) - unlist(map$translation)))
}

plot.pulson_atlas <- function(x, which = c("scores", "mode"), modes = 1:2, sd = 2, axes = 1:2, ...) {
  which <- if (is.character(which)) which[1] else deparse(which)[1]
  if (!which %in% c("scores", "mode"))
    raise("input_error", sprintf("which: \"scores\" or \"mode\" is drawn, and it is %s", which))
  if (which == "mode") return(plot_mode(x, modes[1], sd, axes, ...))
  count <- ncol(x$modes$scores)
  if (missing(modes)) modes <- seq_len(min(2, count))
  if (!is.numeric(modes) || length(modes) == 0 || !all(modes %in% seq_len(count)))
    raise("input_error", sprintf("modes: numbers from 1 to %d are needed", count))
  modes <- utils::head(modes, 2)
  parts <- x$modes$eigenvalues / sum(x$modes$eigenvalues)
  label <- function(mode) sprintf("PC%d (%.1f %%)", mode, 100 * parts[mode])
  colour <- if (is.null(x$group)) 1 else as.integer(factor(x$group))
  if (length(modes) < 2) {
    plot(x$modes$scores[, modes], rep(0, nrow(x$modes$scores)), xlab = label(modes), ylab = "", yaxt = "n", pch = 20,
         col = colour, ...)
  } else {
    plot(x$modes$scores[, modes], xlab = label(modes[1]), ylab = label(modes[2]), asp = 1, pch = 20, col = colour, ...)
    abline(h = 0, v = 0, col = grey(0.8))
    if (nrow(x$modes$scores) <= 40)
      text(x$modes$scores[, modes], rownames(x$modes$scores), cex = 0.7, pos = 3, col = grey(0.4))
  }
  if (!is.null(x$group)) {
    names <- levels(factor(x$group))
    legend("topright", names, pch = 20, col = seq_along(names), bty = "n")
  }
  invisible(x)
}

# The template and the ends of a mode, with what moves between them.
plot_mode <- function(x, mode, sd, axes, ...) {
  k <- ncol(x$template)
  if (k == 1) axes <- c(1, 1)
  check_plot_axes(axes, max(k, 1))
  plus <- pulson_mode(x, mode, sd)
  minus <- pulson_mode(x, mode, -sd)
  all <- rbind(minus, plus, x$template)[, axes]
  plot(all, type = "n", asp = 1, xlab = axis_names(k)[axes[1]], ylab = axis_names(k)[axes[2]],
       main = sprintf("PC%d, -%g to +%g sd", mode, sd, sd), ...)
  segments(minus[, axes[1]], minus[, axes[2]], x$template[, axes[1]], x$template[, axes[2]], col = 4)
  segments(x$template[, axes[1]], x$template[, axes[2]], plus[, axes[1]], plus[, axes[2]], col = 2)
  points(x$template[, axes], pch = 20, cex = 0.7)
  points(plus[, axes], pch = 20, col = 2)
  points(minus[, axes], pch = 20, col = 4)
  legend("topright", c("-", "template", "+"), pch = 20, col = c(4, 1, 2), bty = "n")
  invisible(x)
}

plot.pulson_comparison <- function(x, ...) {
  score <- x$models$difference
  error <- x$models$difference_error
  error[is.na(error)] <- 0
  at <- seq_along(score)
  old <- par(mar = c(5, 10, 2, 1))
  on.exit(par(old))
  plot(score, at, yaxt = "n", pch = 20, xlim = range(0, score - error, score + error, na.rm = TRUE),
       ylim = rev(range(at) + c(-0.5, 0.5)), ylab = "", xlab = "score relative to the best model (nats)", ...)
  abline(v = 0, col = grey(0.8))
  segments(score - error, at, score + error, at)
  axis(2, at, vapply(x$models$noise, short_spec, ""), las = 1, cex.axis = 0.7)
  invisible(x)
}

plot.pulson_audit <- function(x, ...) {
  if (nrow(x$findings) == 0) {
    message("nothing looks wrong")
    return(invisible(x))
  }
  at <- seq_len(nrow(x$findings))
  from <- x$findings$distance_before
  onto <- x$findings$distance_after
  plot(from, at, yaxt = "n", ylab = "", xlab = "rms before and after mending", xlim = range(0, from, onto, na.rm = TRUE),
       pch = 20, ...)
  axis(2, at, x$findings$specimen, las = 1, cex.axis = 0.7)
  known <- is.finite(from) & is.finite(onto) & from != onto
  if (any(known)) arrows(from[known], at[known], onto[known], at[known], length = 0.07, col = 2)
  invisible(x)
}

plot.pulson_sample <- function(x, parameter = NULL, ...) {
  known <- setdiff(names(x$draws), c("chain", "draw"))
  if (is.null(parameter)) parameter <- known[1]
  if (length(parameter) != 1 || !parameter %in% known)
    raise("input_error", sprintf("parameter: '%s' is none of %s", paste(parameter, collapse = ", "), paste(known, collapse = ", ")))
  plot(x$draws[[parameter]], type = "l", xlab = "draw, chain after chain", ylab = parameter, ...)
  invisible(x)
}
