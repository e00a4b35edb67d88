# The program: where it is, how it is called, and what its exit codes become.

pulson_program <- function(required = TRUE) {
  asked <- getOption("pulson.program", Sys.getenv("PULSON"))
  if (!is.character(asked) || length(asked) != 1 || is.na(asked))
    raise("program_error", "options(pulson.program): the path of the program is needed")
  found <- if (nzchar(asked)) path.expand(asked) else unname(Sys.which("pulson"))
  is_file <- nzchar(found) && file.exists(found) && !dir.exists(found)
  if (is_file && grepl("^pulson [0-9]", said(found, "--version")[1])) return(normalizePath(found))
  if (!required) return("")
  by <- if (is.null(getOption("pulson.program"))) "the environment variable PULSON" else "options(pulson.program)"
  raise("program_error", if (is_file) {
    paste0("'", found, "', which ", if (nzchar(asked)) paste(by, "names") else "is on the path",
           ", is not the program pulson: it does not say so for --version")
  } else if (nzchar(asked)) {
    paste0("there is no program '", asked, "', which ", by, " names")
  } else {
    paste("the program 'pulson' is not on the path; install it, or name it by",
          "options(pulson.program = \"/path/to/pulson\") or the environment variable PULSON")
  })
}

pulson_available <- function() nzchar(pulson_program(required = FALSE))

pulson_version <- function() numeric_version(sub("^pulson +([0-9.]+).*", "\\1", said(pulson_program(), "--version")[1]))

# What a program says of itself, asked once for each state of its file.
said_before <- new.env()

said <- function(program, words) {
  facts <- file.info(program, extra_cols = FALSE)
  key <- paste(c(normalizePath(program), facts$size, as.numeric(facts$mtime), words), collapse = " ")
  if (is.null(said_before[[key]])) {
    lines <- tryCatch(suppressWarnings(system2(program, words, stdout = TRUE, stderr = FALSE, stdin = nullfile(),
                                               timeout = 30)), error = function(e) character())
    if (length(lines) == 0) return("")  # perhaps it is being replaced; it is asked again
    said_before[[key]] <- enc2utf8(as.character(lines))
  }
  said_before[[key]]
}

# The options of a verb, by its help: `takes`, the word that stands for the value ("" of a switch), and `help`.
verb_options <- function(verb) {
  lines <- said(pulson_program(), c(verb, "--help-all"))
  at <- grep("^  (-[[:alpha:]],)?--[a-z]", lines)
  parts <- regmatches(lines[at], regexec(
    "^  (-[[:alpha:]],)?--([a-z0-9-]+)(,--([a-z0-9-]+))?( (([A-Z][^ ]*|i/n)( [.]{3})?))?(  +(.*))?$", lines[at]))
  held <- parts[lengths(parts) > 0]
  options <- lapply(seq_along(held), function(i) {
    begin <- at[lengths(parts) > 0][i]
    more <- lines[-seq_len(begin)]
    more <- more[cumsum(!startsWith(more, strrep(" ", 20))) == 0]
    list(takes = held[[i]][7], help = paste(c(held[[i]][11], trimws(more)), collapse = " "))
  })
  names(options) <- vapply(held, function(part) part[3], "")
  both <- vapply(held, function(part) part[5], "")
  c(options, setNames(options[nzchar(both)], both[nzchar(both)]))
}

# A condition of the classes pulson_KIND and pulson_error.
raise <- function(kind, message, ...) {
  stop(structure(class = c(paste0("pulson_", kind), "pulson_error", "error", "condition"),
                 list(message = message, call = NULL, ...)))
}

warn <- function(kind, message) {
  warning(structure(class = c(paste0("pulson_", kind), "pulson_warning", "warning", "condition"),
                    list(message = message, call = NULL)))
}

note <- function(message) {
  message(structure(class = c("pulson_note", "message", "condition"),
                    list(message = paste0("note: ", message, "\n"), call = NULL)))
}

# A number with the fewest digits that read back to the same bits.
number_text <- function(x) {
  if (!is.finite(x)) return(as.character(x))
  text <- sprintf("%.15g", x)
  if (exact_numbers(text) == x) text else sprintf("%.17g", x)
}

value_text <- function(value, refuse) {
  if (is.na(value) || !(is.character(value) || is.numeric(value))) refuse("a text or a number is needed")
  if (is.numeric(value)) number_text(value) else enc2utf8(value)
}

# TRUE or FALSE, of an argument that is either.
truth <- function(value, name) {
  if (!is.logical(value) || length(value) != 1 || is.na(value))
    raise("input_error", paste0(name, ": it is a switch; TRUE or FALSE is needed"))
  value
}

# A single text, of an argument that names a file or a folder.
one_file <- function(value, name, of = "file") {
  if (!is.character(value) || length(value) != 1 || is.na(value) || !nzchar(value))
    raise("input_error", sprintf("%s: the name of a %s is needed, and it is of the class %s", name, of, class(value)[1]))
  value
}

# list(noise = "ch-sd:beta=4", no_picture = TRUE) as the words of a command line.
# @param cohort the shapes whose specimens a vector has a value for, where an option takes a column of a table
option_words <- function(options, verb, cohort = NULL, work = NULL) {
  names <- names(options)
  if (length(options) > 0 && (is.null(names) || any(!nzchar(names))))
    raise("input_error", paste("an argument has no name; options of the program are given by their names,",
                               "as in noise = \"ch-sd:beta=5%\""))
  taken <- intersect(names, c("out", "json", "shard", "xml", "config", "print_config", "help", "help_all", "quiet",
                              "verbose"))
  if (length(taken) > 0) raise("input_error", sprintf("%s is set by this package; leave it out", taken[1]))
  known <- if (length(options) > 0) verb_options(verb)
  words <- lapply(seq_along(options), function(i) {
    flag <- gsub("_", "-", names[i], fixed = TRUE)
    words_of_option(names[i], paste0("--", flag), options[[i]], known, cohort, work)
  })
  unlist(words)
}

words_of_option <- function(name, flag, value, known, cohort, work) {
  takes <- known[[substring(flag, 3)]]$takes
  refuse <- function(...) raise("input_error", paste0(name, ": ", sprintf(...)))
  if (is.null(value)) return(character())
  if (identical(takes, "")) {
    if (truth(value, name)) return(flag)
    return(if (flag == "--flip-y") "--no-flip-y" else character())
  }
  is_truth <- is.logical(value) && length(value) == 1
  if (is.null(takes) && is_truth) return(flag)  # which the program does not know, and says so
  if (!is.atomic(value) || length(value) == 0) refuse("a text or a number is needed")
  if (identical(takes, "FILE.csv:COLUMN") && (length(value) > 1 || !is.character(value)))
    return(c(paste0(flag, "=", column_file(setNames(list(value), name), cohort, work, name), ":", name), 
             if (anyDuplicated(cohort$names)) "--by-order"))
  if (is.factor(value)) value <- as.character(value)
  if (is_truth)
    refuse("it is no switch, and %s no value of it: %s", value, in_arguments(known[[substring(flag, 3)]]$help, known))
  if (length(takes) > 0 && startsWith(takes, "FILE")) {
    if (!is.character(value)) refuse("the name of a file is needed")
    value[!is.na(value)] <- path.expand(value[!is.na(value)])
  }
  texts <- vapply(value, value_text, "", refuse, USE.NAMES = FALSE)
  if (!is.null(names(value))) texts <- ifelse(nzchar(names(value)), paste0(names(value), "=", texts), texts)
  if (length(takes) > 0 && !endsWith(takes, "...") && length(texts) > 1) {
    if (!takes %in% c("LIST", "NAMES", "NUMBERS", "X,Y", "COLOUR", "WxH"))
      refuse("it takes one value, and %d are given", length(texts))
    texts <- paste(texts, collapse = if (takes == "WxH") "x" else ",")
  }
  paste0(flag, "=", texts)
}

# Runs the program. Files of `folder`, which it names in messages, are what the caller knows them as.
# Returns what it printed. Exit codes: 0 done, 3 done without convergence, 2 wrong use, 1 a fault of the program.
run_program <- function(words, folder) {
  program <- pulson_program()
  words <- words[words != "--by-order" | !duplicated(words)]
  out <- file.path(folder, "printed")
  err <- file.path(folder, "messages")
  # Quotes keep an empty or odd word one word; system2 passes the rest to a shell.
  status <- system2(program, shQuote(words), stdout = out, stderr = err, stdin = "")
  messages <- readLines(err, encoding = "UTF-8", warn = FALSE)
  messages <- in_words_of_r(messages, folder, words[1])
  unlink(err)
  if (status == 127) raise("program_error", sprintf("the program '%s' cannot be run", program))
  is_error <- startsWith(messages, "pulson: ")
  error <- sub("^pulson: ", "", messages[is_error])
  if (!status %in% c(0, 3)) {
    kind <- if (status == 2) "input_error" else "internal_error"
    if (length(error) == 0)
      error <- c(messages, sprintf("the program ended with code %s and no message", status))
    raise(kind, paste(error, collapse = "\n"), status = status)
  }
  for (line in messages) {
    if (startsWith(line, "warning: ")) warn("warning", sub("^warning: ", "", line))
    else if (startsWith(line, "note: ")) note(sub("^note: ", "", line))
    else if (nzchar(line)) note(sub("^pulson: ", "", line))
  }
  if (status == 3) warn("not_converged", "the search did not converge; the results are those where it stopped")
  printed <- readLines(out, encoding = "UTF-8", warn = FALSE)
  unlink(out)
  in_words_of_r(printed[!startsWith(printed, "wrote ")], folder, words[1])
}

# Files of the run are called after the arguments that they hold, a command for the shell after its function, and options
# as arguments, with their values as R has them.
in_words_of_r <- function(lines, folder, verb) {
  lines <- gsub(paste0(folder, .Platform$file.sep), "", lines, fixed = TRUE)
  arguments <- "(source|target|shapes|points|reference|template|momenta)"
  lines <- gsub(paste0("\\b", arguments, "[.]json\\b"), "\\1", lines)
  is_list <- sub("[.]list$", "", list.files(folder, "[.]list$"))
  choice <- paste0("; choose one as ", arguments, "#1 or [^;]*")
  for (name in is_list) lines <- sub(sub("[(].*[)]", name, choice), sprintf("; choose one, as %s[[1]]", name), lines)
  lines <- gsub(choice, "; choose one, as \\1[, , 1]", lines)
  lines <- gsub("; choose one as ([^;]*#1) or [^;]*", "; choose one, as \"\\1\"", lines)
  lines <- gsub("; pulson (audit|sample|register)( (source|target|shapes|reference))+$", "; see pulson_\\1()", lines)
  lines <- gsub(" [(]see pulson [a-z]+ --help[)]", "", lines)
  lines <- gsub("--no-flip-y", "flip_y = FALSE", lines, fixed = TRUE)
  if (any(grepl("--", lines, fixed = TRUE))) lines <- in_arguments(lines, verb_options(verb))
  lines
}

in_arguments <- function(lines, known) {
  options <- gregexpr("(?<![-[:alnum:]])--[a-z][a-z0-9-]*([ =][[:alnum:]%.:=+-]+(,[[:alnum:]%.:=+-]+)*)?", lines, perl = TRUE)
  regmatches(lines, options) <- lapply(regmatches(lines, options), vapply, argument_text, "", known)
  lines
}

# "--scale apply" as scale = "apply"; a word after an option is its value only where its help has it as one.
argument_text <- function(text, known) {
  option <- sub("^--([a-z0-9-]+).*", "\\1", text)
  name <- gsub("-", "_", option)
  rest <- substring(text, nchar(option) + 3)
  value <- sub("[.:]+$", "", substring(rest, 2))
  takes <- known[[option]]$takes
  if (!nzchar(value) || is.null(takes) || !nzchar(takes)) return(paste0(name, rest))
  plain <- c("is", "are", "has", "and", "or", "to", "in", "of", "for", "by", "with", "which", "that", "needs", "names")
  is_value <- startsWith(rest, "=") || grepl("^[0-9]|[:=%]", value) ||
    (grepl("^(NAME|SPEC|SHAPE|LENGTH|NUMBER)", takes) && !value %in% plain &&
       grepl(paste0("\\b", value, "\\b"), known[[option]]$help))
  if (!is_value) return(paste0(name, rest))
  quoted <- if (grepl("^-?[0-9.]+(e[-+]?[0-9]+)?$", value)) value else paste0("\"", value, "\"")
  paste0(name, " = ", quoted, substring(rest, nchar(value) + 2))
}

# A folder for the files of one run. Its parts have no name that looks like a label of a shape.
run_folder <- function() {
  folder <- tempfile("pulson_")
  dir.create(folder)
  normalizePath(folder)
}

# The page and the pictures of a run take most of its time, and R draws its own.
default_options <- function(options) {
  if (is.null(options$no_picture) && is.null(options$pictures)) options$no_picture <- TRUE
  options
}
