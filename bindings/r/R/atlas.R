# Templates of cohorts, and regression on them by a formula.

pulson_atlas <- function(shapes, data = NULL, ..., out = NULL) {
  options <- default_options(list(...))
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  folder <- result_folder(out, work)
  call <- if (inherits(shapes, "formula")) shapes_of_formula(shapes, data, parent.frame()) else list(shapes = shapes)
  if (!inherits(shapes, "formula") && !is.null(data))
    raise("input_error", "data: it is for a formula, as in pulson_atlas(shape ~ log(size), data)")
  taken <- intersect(names(options), c("covariate", "groups", "model", "data"))
  if (length(call$terms) > 0 && length(taken) > 0)
    raise("input_error", sprintf("%s: the formula says it; leave it out", taken[1]))
  cohort <- shape_argument(call$shapes, "shapes", work)
  if (!is.null(cohort$shapes) && length(cohort$shapes$points) < 2)
    raise("input_error", "shapes: there is one specimen; an atlas needs two or more")
  words <- c("atlas", cohort$words, paste0("--out=", folder), option_words(options, "atlas", cohort$shapes, work))
  if (length(call$terms) > 0) {
    words <- c(words, regression_words(call, cohort, work))
  }
  printed <- in_terms_of(call, run_program(words, work))
  atlas_of(folder, printed, call)
}

# The variables of a formula, evaluated, and its terms as sets of them.
shapes_of_formula <- function(formula, data, frame) {
  unsupported <- function(...) raise("input_error", paste0("formula: ", sprintf(...)))
  if (length(formula) != 3) unsupported("shapes are needed on its left, as in shape ~ log(size)")
  held <- if (is.null(data)) frame else as.list(data)
  shapes <- tryCatch(eval(formula[[2]], held, environment(formula)), error = function(e)
    unsupported("%s; its left side is the array of shapes", conditionMessage(e)))
  right <- tryCatch(terms(formula[-2], data = if (is.null(data)) NULL else as.list(data)[!vapply(data, is.array, NA)]),
                    error = function(e) unsupported("%s", conditionMessage(e)))
  if (!is.null(attr(right, "offset"))) unsupported("it has an offset, which an atlas does not")
  if (attr(right, "intercept") == 0) unsupported("it has no intercept, and the regression of an atlas has one")
  factors <- attr(right, "factors")
  if (length(factors) == 0) return(list(shapes = shapes))
  labels <- rownames(factors)
  values <- lapply(labels, function(label) {
    value <- tryCatch(eval(str2lang(label), held, environment(formula)), error = function(e)
      unsupported("%s%s", conditionMessage(e), if (grepl("'size'|'Csize'", conditionMessage(e)))
        "; centroid_size(shapes) computes it" else ""))
    if (is.matrix(value) && ncol(value) == 1) value <- value[, 1]
    if (length(dim(value)) == 1) value <- setNames(as.vector(value), names(value))
    if (is.numeric(value) && is.null(dim(value))) return(value)
    if (is.factor(value) || is.character(value) || is.logical(value)) return(factor(value))
    unsupported("%s is a %s; a column of numbers or a factor is needed", label, class(value)[1])
  })
  names(values) <- labels
  members <- lapply(seq_len(NCOL(factors)), function(term) labels[factors[, term] > 0])
  list(shapes = shapes, terms = if (length(values) > 0) values, members = members)
}

regression_words <- function(call, cohort, work) {
  path <- column_file(call$terms, cohort$shapes, work, "formula")
  c(model_words(call, path), if (anyDuplicated(cohort$shapes$names)) "--by-order")
}

# A table of `columns`, each with a value for each specimen of `shapes`.
column_file <- function(columns, shapes, work, what) {
  refuse <- function(...) raise("input_error", paste0(what, ": ", sprintf(...)))
  if (is.null(shapes)) refuse("the shapes are in a file; pulson_read() makes an array of it")
  count <- length(shapes$points)
  cell <- function(column) paste0("\"", gsub("\"", "\"\"", enc2utf8(as.character(column))), "\"")
  names <- if (is.null(shapes$names)) what else shapes$names
  cells <- list(cell(names))
  for (variable in names(columns)) {
    value <- columns[[variable]]
    of <- if (variable == what) "it" else variable
    if (length(value) != count)
      refuse("%s has %d value%s for %d specimens", of, length(value), if (length(value) == 1) "" else "s", count)
    known <- names(value)
    if (!is.null(known) && !identical(known, names)) {
      if (!setequal(known, names) || anyDuplicated(known)) {
        note(sprintf("the names of %s are not those of the specimens: its values are taken by their order", variable))
      } else {
        value <- value[match(names, known)]
      }
    }
    if (is.numeric(value) && any(is.infinite(value))) refuse("%s has an infinite value", of)
    cells[[length(cells) + 1]] <- if (is.numeric(value)) {
      ifelse(is.na(value), "NA", sprintf("%.17g", value))
    } else {
      ifelse(is.na(value), "NA", cell(value))
    }
  }
  path <- file.path(work, paste0(what, ".csv"))
  connection <- file(path, "wb", encoding = "bytes")
  header <- paste(c("specimen", cell(names(columns))), collapse = ",")
  writeLines(c(header, do.call(paste, c(cells, sep = ","))), connection, useBytes = TRUE)
  close(connection)
  path
}

# A single variable as --covariate or --groups, whose geodesics and means the program gives too; else the formula.
model_words <- function(call, path) {
  is_group <- vapply(call$terms, is.factor, NA)
  labels <- names(call$terms)
  if (any(grepl("`", labels, fixed = TRUE))) raise("input_error", "formula: a name in it has a backtick")
  if (length(call$members) == 1 && length(labels) == 1 && !grepl(":", labels, fixed = TRUE))
    return(paste0(if (is_group) "--groups=" else "--covariate=", path, ":", labels))
  variables <- ifelse(is_group, sprintf("factor(`%s`)", labels), sprintf("`%s`", labels))
  names(variables) <- labels
  formula <- paste(vapply(call$members, function(term) paste(variables[term], collapse = ":"), ""), collapse = " + ")
  c(paste0("--model=", formula), paste0("--data=", path))
}

# Texts of the program with the factors as the formula has them.
with_labels <- function(texts, call) {
  for (label in names(Filter(is.factor, call$terms)))
    texts <- gsub(sprintf("factor(%s)", label), label, texts, fixed = TRUE)
  texts
}

# The same of printed tables, whose columns stay where they are.
printed_with_labels <- function(lines, call) {
  texts <- with_labels(lines, call)
  spaces <- strrep(" ", nchar(lines) - nchar(texts))
  cell <- regexpr("^ +[^ ]+( [^ ]+)*(?=  )", texts, perl = TRUE)
  end <- ifelse(cell > 0, attr(cell, "match.length"), nchar(texts))
  ifelse(nzchar(spaces) & cell > 0, paste0(substring(texts, 1, end), spaces, substring(texts, end + 1)), texts)
}

# What `run` prints, and its conditions, with the factors as the formula has them.
in_terms_of <- function(call, run) {
  again <- function(signal, restart) function(condition) {
    text <- with_labels(conditionMessage(condition), call)
    if (identical(text, conditionMessage(condition))) return()
    condition$message <- text
    signal(condition)
    if (!is.null(restart)) invokeRestart(restart)
  }
  printed_with_labels(withCallingHandlers(run, pulson_error = again(stop, NULL),
                                          pulson_warning = again(warning, "muffleWarning"),
                                          pulson_note = again(message, "muffleMessage")), call)
}

# The analysis of variance, pairs of groups and coefficients of a formula.
model_tables <- function(folder, call) {
  read <- function(name, columns) {
    table <- read_table(file.path(folder, name))
    for (column in columns) table[[column]] <- with_labels(table[[column]], call)
    table
  }
  list(anova = read("model.csv", c("model", "term")), pairs = read("pairs.csv", c("model", "term")),
       coefficients = read("coefficients.csv", c("model", "coefficient")))
}

atlas_of <- function(folder, printed, call) {
  record <- read_record(file.path(folder, "atlas.json"))
  values <- record$values
  scores <- read_table(file.path(folder, "scores.csv"))
  specimens <- read_table(file.path(folder, "specimens.csv"), "converged")
  aligned <- read_table(file.path(folder, "aligned.csv"))
  labels <- template_labels(folder)
  names <- specimens$specimen
  template <- as_points(values$template, labels)
  momenta <- aperm(read_npy(file.path(folder, "momenta.npy")), c(2, 3, 1))
  dimnames(momenta) <- list(labels, axis_names(dim(momenta)[2]), names)
  mode_names <- function(matrix) {
    matrix <- as.matrix(matrix)
    dimnames(matrix) <- list(names, paste0("PC", seq_len(ncol(matrix))))
    matrix
  }
  result <- list(template = template, specimens = specimens, momenta = momenta,
                 modes = list(eigenvalues = values$modes$eigenvalues, scores = mode_names(values$modes$scores)),
                 procrustes = list(mean = as_points(values$procrustes$mean),
                                   eigenvalues = values$procrustes$eigenvalues,
                                   scores = mode_names(values$procrustes$scores)),
                 aligned = table_points(aligned, names, labels), kernel = values$kernel, lambda = values$lambda,
                 sigma = values$sigma, converged = values$converged, regression = values$regression,
                 groups = values$groups, terms = call$terms, record = values, printed = printed)
  if (file.exists(file.path(folder, "model.csv"))) result <- c(result, model_tables(folder, call))
  if (!is.null(result$regression)) {
    if (length(call$terms) > 0) result$regression$covariate <- names(call$terms)
    result$regression$slope <- as_points(result$regression$slope, labels)
    result$regression$intercept <- as_points(result$regression$intercept, labels)
  }
  if (!is.null(result$groups) && length(call$terms) > 0) result$groups$term <- names(call$terms)
  if (!is.null(scores$group)) result$group <- scores$group
  complete <- file.path(folder, "complete.csv")
  if (file.exists(complete)) {
    result$complete <- table_points(read_table(complete), names, labels)
    result$predicted <- read_table(file.path(folder, "predicted.csv"))
  }
  structure(result, class = "pulson_atlas")
}

template_labels <- function(folder) {
  path <- file.path(folder, "template.json")
  if (!file.exists(path)) return(NULL)
  held <- jsonlite::fromJSON(read_record(path)$text, simplifyDataFrame = FALSE)
  held$shapes[[1]]$labels
}

# A table of the columns x, y, z, a row for each landmark of each specimen in turn.
table_points <- function(table, names, labels) {
  axes <- intersect(c("x", "y", "z"), names(table))
  count <- nrow(table) / length(names)
  points <- array(unlist(table[axes], use.names = FALSE), c(count, length(names), length(axes)))
  points <- aperm(points, c(1, 3, 2))
  dimnames(points) <- list(if (length(labels) == count) labels, axis_names(length(axes)), names)
  points
}

# The momenta of one standard deviation along a mode: scores are coordinates in the momenta of the modes.
mode_momenta <- function(atlas, mode) {
  if (!is.numeric(mode) || length(mode) != 1 || !mode %in% seq_along(atlas$modes$eigenvalues))
    raise("input_error", sprintf("mode: a number from 1 to %d is needed", length(atlas$modes$eigenvalues)))
  scores <- atlas$modes$scores[, mode]
  unit <- apply(atlas$momenta, c(1, 2), function(p) sum(p * scores)) / sum(scores^2)
  unit * sqrt(atlas$modes$eigenvalues[mode])
}

pulson_mode <- function(atlas, mode = 1, sd = 2) {
  if (!inherits(atlas, "pulson_atlas")) raise("input_error", "atlas: what pulson_atlas() returns is needed")
  if (!is.numeric(sd) || length(sd) != 1 || !is.finite(sd))
    raise("input_error", "sd: a number of standard deviations is needed")
  if (atlas$record$noise != "none")
    raise("input_error", "atlas: its modes are of a metamorphosis; shapes along them are drawn by the program alone (out = FOLDER, no_picture = FALSE)")
  shot(atlas, sd * mode_momenta(atlas, mode))
}

# The end of the geodesic from the template, by the steps of the atlas.
shot <- function(atlas, momenta) {
  work <- run_folder()
  on.exit(unlink(work, recursive = TRUE))
  shape <- write_shapes(list(points = list(atlas$template)), file.path(work, "template.json"))
  p <- write_shapes(list(points = list(plain_points(matrix(momenta, nrow(momenta))))), file.path(work, "momenta.json"))
  out <- file.path(work, "path")
  run_program(c("simulate", paste0("--shape=", shape), paste0("--momenta=", p), paste0("--kernel=", atlas$kernel),
                "--noise=none", "--integrator=rk4", "--time=1", paste0("--steps=", atlas$record$steps),
                "--no-picture", "--quiet", paste0("--out=", out)), work)
  path <- read_table(file.path(out, "paths.csv"))
  last <- path[path$time == max(path$time), ]
  as_points(as.matrix(last[grep("^q", names(last))]), rownames(atlas$template))
}

print.pulson_atlas <- function(x, ...) {
  cat(sprintf("Atlas of %d shapes of %d landmarks in %dD by pulson\n", nrow(x$specimens), nrow(x$template),
              ncol(x$template)))
  cat(sprintf("model    kernel %s, lambda %.4g, sigma %.4g\n", short_spec(x$kernel), x$lambda, x$sigma))
  parts <- x$modes$eigenvalues / sum(x$modes$eigenvalues)
  shown <- seq_len(min(5, length(parts)))
  cat(sprintf("modes    %s %% of the variance\n", paste(sprintf("%.1f", 100 * parts[shown]), collapse = ", ")))
  if (!is.null(x$anova)) print_anova(x)
  if (!is.null(x$predicted))
    cat(sprintf("missing  %d landmarks of %d specimens are predicted: $complete, $predicted\n", nrow(x$predicted),
                length(unique(x$predicted$specimen))))
  if (!isTRUE(x$converged)) cat("NOT CONVERGED\n")
  invisible(x)
}

print_anova <- function(x) {
  columns <- c("df", "procrustes_r_squared", "procrustes_f", "procrustes_z", "procrustes_p_value", "r_squared", "f", "z",
               "p_value")
  models <- unique(x$anova$model)
  for (i in seq_along(models)) {
    table <- x$anova[x$anova$model == models[i] & x$anova$term != "total", ]
    shown <- format(table[columns], digits = 4)
    shown[is.na(table[columns])] <- ""
    dimnames(shown) <- list(make.unique(table$term), c("Df", "R2", "F", "Z", "p", "momenta R2", "F", "Z", "p"))
    cat(sprintf("model    %s, %d specimens, %s permutations; Procrustes coordinates, then momenta\n", models[i],
                x$record$models$specimens[i], x$record$models$permutations[i]))
    print(shown)
  }
}

summary.pulson_atlas <- function(object, ...) summary_of(object)

as.data.frame.pulson_atlas <- function(x, ...) cbind(x$specimens, as.data.frame(x$modes$scores, row.names = NULL))
